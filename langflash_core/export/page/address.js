// What the address says: #view=1&ask=plant&mode=photo&bare. Whatever it says, a view and a row that are there.

// `views`: how many; `texts`: phrases. row: of the phrase asked, or -1.
function readAddress(hash, views, texts) {
  const said = new URLSearchParams(hash.slice(1));
  const number = /^\d{1,9}$/.test(said.get("view")) ? Number(said.get("view")) : 0;
  return {
    bare: said.has("bare"),
    view: number < views ? number : 0,
    row: texts.indexOf(said.get("ask")),
    heat: said.get("mode") !== "photo",
  };
}
