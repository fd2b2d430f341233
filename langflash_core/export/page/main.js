// Begins.
// The scenes after the first, one by one.
async function others(page) {
  const { shaders, constants } = page.header;
  for (let number = 1; find(`header${number}`); ++number)
    page.add(await world(number, { shaders, constants }));
}

// For programs that drive the page: a promise of it.
window.langflash = open();
window.langflash.catch((error) => {
  find("waiting").textContent = error.message;
});
