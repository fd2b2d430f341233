// What the address says: #view=1&ask=plant&mode=photo&bare, #stop=NAME, #plan. Whatever that is, what comes of it
// is there, or -1.

// `views`: how many; `stops`: their names; `texts`: phrases, whose row is asked.
function readAddress(hash, views, stops, texts) {
  const said = new URLSearchParams(hash.slice(1));
  const number = /^\d{1,9}$/.test(said.get("view")) ? Number(said.get("view")) : -1;
  return {
    bare: said.has("bare"),
    plan: said.has("plan"),
    view: number < views ? number : -1,
    stop: stops.indexOf(said.get("stop")),
    row: texts.indexOf(said.get("ask")),
    heat: said.get("mode") !== "photo",
  };
}
