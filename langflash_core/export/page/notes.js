// Notes: labels at points of the scene that hide behind what lies before them, and lines between two points with
// their length. A hidden one is still reached by the keyboard; then it shows itself, and the camera turns to it.

const SHOWS = 0.5; // of a point's light that has to pass
const SHORT = 34; // letters of a note that is not chosen

// A length for people: metres where the scene's scale is known.
function measured(units, metric) {
  if (!metric) return `${units.toFixed(2)} units`;
  const metres = units * metric;
  return metres < 1 ? `${Math.round(100 * metres)} cm` : `${metres.toFixed(2)} m`;
}

class Notes {
  // chosen(note): one was pressed. reached(note): one that is not in sight got the focus.
  constructor({ chosen, reached }) {
    Object.assign(this, { chosen, reached });
    this.list = find("notes");
    this.lines = document.querySelector("#lines g");
    this.labels = [];
    this.turn = 0; // of the label whose sight is judged next
  }

  show(world) {
    this.world = world;
    this.labels = world.header.notes.map((note) => this.label(note));
    this.list.replaceChildren(...this.labels.map(({ item }) => item));
    this.lines.replaceChildren(...this.labels.map(({ line }) => line).filter(Boolean));
  }

  label(note) {
    const told = note.to && measured(length(plus(note.to, note.at, -1)), this.world.header.metric);
    const whole = [note.text, told].filter(Boolean).join(" · ");
    const button = element("button", "", { class: "note", "aria-expanded": false });
    const text = element("span", shortened(whole));
    button.append(text);
    const item = element("li", "", note.to ? { class: "measure" } : {});
    item.append(button);
    const line = note.to && document.createElementNS(this.lines.namespaceURI, "line");
    const label = { note, item, button, line, sees: true, whole, text };
    button.addEventListener("click", () => this.press(label));
    button.addEventListener("focus", () => label.away && this.reached(note));
    return label;
  }

  press(label) {
    const open = label.button.getAttribute("aria-expanded") !== "true";
    for (const other of this.labels) this.open(other, other === label && open);
    if (open) this.chosen(label.note);
  }

  open(label, open) {
    label.button.setAttribute("aria-expanded", open);
    label.text.textContent = open ? label.whole : shortened(label.whole);
  }

  // Where the labels are in a picture of a lens, in the page's pixels; all of them judged, or one more.
  place(camera, lens, ratio, all) {
    const judged = all ? this.labels : this.labels.slice(this.turn, this.turn + 1);
    this.turn = (this.turn + 1) % Math.max(this.labels.length, 1);
    for (const label of judged) label.sees = this.seen(label.note, camera.eye);
    for (const label of this.labels) this.put(label, camera, lens, ratio);
  }

  seen({ at, to }, eye) {
    return [at, to].some((point) => point && this.world.light(eye, point) >= SHOWS);
  }

  put(label, camera, lens, ratio) {
    const { note, item, line } = label;
    const ends = [note.at, note.to].filter(Boolean).map((point) => pixel(point, camera, lens, ratio));
    const middle = note.to ? plus(note.at, note.to).map((value) => value / 2) : note.at;
    const [x, y, depth] = pixel(middle, camera, lens, ratio);
    const inside = depth > NEAR && x > 0 && y > 0 && x < lens.size[0] / ratio && y < lens.size[1] / ratio;
    label.away = !inside || !label.sees;
    item.classList.toggle("away", label.away);
    item.classList.toggle("left", x > (0.66 * lens.size[0]) / ratio);
    item.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    item.style.zIndex = Math.max(1, Math.round(1e4 / Math.max(depth, 0.01)));
    if (!line) return;
    line.style.display = label.away || ends.some((end) => end[2] < NEAR) ? "none" : "";
    for (const end of [0, 1])
      for (const axis of [0, 1]) line.setAttribute(`${"xy"[axis]}${end + 1}`, ends[end][axis].toFixed(1));
  }
}

function shortened(text) {
  return text.length > SHORT ? `${text.slice(0, SHORT - 1).trimEnd()}…` : text;
}

// [x, y, depth] of a point in the page's pixels.
function pixel(point, camera, lens, ratio) {
  const offset = plus(point, camera.eye, -1);
  const z = dot(offset, camera.turn[2]);
  const [fx, fy, cx, cy] = lens.pinhole;
  return [
    ((dot(offset, camera.turn[0]) / z) * fx + cx) / ratio,
    ((dot(offset, camera.turn[1]) / z) * fy + cy) / ratio,
    z,
  ];
}
