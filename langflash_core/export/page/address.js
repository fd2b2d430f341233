// What the address says: #photo=2&ask=plant&mode=photo&bare, #stop=NAME, #plan. Whatever it says, places and
// a phrase that are there, or none. Photos count from 1; addresses of before say `view`, from 0.

// `views`: how many; `stops`, `texts`: names and phrases. view, stop, row: of the view, the stop and the
// phrase that are named, or -1.
function readAddress(hash, views, stops, texts) {
  const said = new URLSearchParams(hash.slice(1));
  const numbered = (name) => (/^\d{1,9}$/.test(said.get(name)) ? Number(said.get(name)) : -1);
  const number = said.has("photo") ? numbered("photo") - 1 : numbered("view");
  return {
    bare: said.has("bare"),
    view: number < views ? Math.max(number, -1) : -1,
    stop: stops.indexOf(said.get("stop")),
    row: texts.indexOf(said.get("ask")),
    heat: said.get("mode") !== "photo",
    plan: said.has("plan"),
  };
}
