// Opens a page of scenes without layers; layers.js does it where one has some.
// A scene of the page by its number; the first one has what all are drawn by.
async function world(number, first) {
  const header = { ...first, ...JSON.parse(find(`header${number || ""}`).textContent) };
  const columns = readColumns(header.columns, await inflated(find(`payload${number || ""}`).textContent));
  find(`payload${number || ""}`).remove();
  return new World(find("stage"), header, columns);
}

async function open() {
  const page = new Page(await world(0, {}));
  await new Promise(requestAnimationFrame);
  find("waiting").remove();
  page.rooms = others(page);
  page.embedding.say("ready", { title: page.header.title, stops: page.header.stops.map(({ name }) => name) });
  return page;
}
