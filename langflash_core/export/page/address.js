// What the address says: #view=1&ask=plant&mode=photo&bare, #stop=NAME, #plan. Whatever it says, places and
// a phrase that are there, or none.

// `views`: how many; `stops`, `texts`: names and phrases. view, stop, row: of the view, the stop and the
// phrase that are named, or -1.
function readAddress(hash, views, stops, texts) {
  const said = new URLSearchParams(hash.slice(1));
  const number = /^\d{1,9}$/.test(said.get("view")) ? Number(said.get("view")) : -1;
  return {
    bare: said.has("bare"),
    view: number < views ? number : -1,
    stop: stops.indexOf(said.get("stop")),
    row: texts.indexOf(said.get("ask")),
    heat: said.get("mode") !== "photo",
    plan: said.has("plan"),
  };
}
