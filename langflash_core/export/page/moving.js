// Mouse, touch and keys to movements of an Orbit; flights from one view to another.

const TURN = 0.005; // radians a pixel
const WHEEL = 0.0012; // of the logarithm of a distance, a pixel
const FLIGHT = 450; // milliseconds
const RATES = { turn: 1.4, move: 0.7, zoom: 1.2 }; // a second: radians, distances, logarithms
const KEYS = {
  ArrowLeft: ["orbit", 1, 0],
  ArrowRight: ["orbit", -1, 0],
  ArrowUp: ["orbit", 0, 1],
  ArrowDown: ["orbit", 0, -1],
  KeyA: ["move", -1, 0, 0],
  KeyD: ["move", 1, 0, 0],
  KeyQ: ["move", 0, 1, 0],
  KeyE: ["move", 0, -1, 0],
  KeyW: ["move", 0, 0, 1],
  KeyS: ["move", 0, 0, -1],
  Equal: ["zoom", -1],
  NumpadAdd: ["zoom", -1],
  Minus: ["zoom", 1],
  NumpadSubtract: ["zoom", 1],
};

class Moving {
  // stage: the element that is dragged. nearest: distance. focal(): pixels. changed(): the camera moved.
  // aimed(x, y): a double click. taken(): somebody took the camera into the own hands.
  constructor(stage, orbit, nearest, { focal, changed, aimed, taken }) {
    Object.assign(this, { stage, orbit, nearest, focal, changed, taken });
    this.fingers = new Map();
    this.pressed = new Set();
    this.flight = null;
    stage.addEventListener("pointerdown", (event) => this.press(event));
    stage.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of ["pointerup", "pointercancel"])
      stage.addEventListener(name, (event) => this.fingers.delete(event.pointerId));
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    stage.addEventListener("dblclick", (event) => aimed(event.offsetX, event.offsetY));
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("keyup", (event) => this.pressed.delete(event.code));
    addEventListener("blur", () => this.pressed.clear());
  }

  press(event) {
    this.stage.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    this.halt();
  }

  halt() {
    this.flight = null;
    this.taken();
  }

  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const others = [...this.fingers.keys()].filter((id) => id !== event.pointerId);
    const now = [event.clientX, event.clientY];
    const [right, down] = [now[0] - before[0], now[1] - before[1]];
    if (others.length) this.pinch(before, now, this.fingers.get(others[0]));
    else if (event.buttons & 6 || event.shiftKey) this.pan(right, down);
    else this.orbit.orbit(TURN * right, TURN * down);
    this.fingers.set(event.pointerId, now);
    this.changed();
  }

  // Two fingers: their middle pans, what lies between them zooms.
  pinch(before, now, other) {
    const spread = (a) => Math.max(1, Math.hypot(a[0] - other[0], a[1] - other[1]));
    this.orbit.zoom(spread(before) / spread(now), this.nearest);
    this.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
  }

  // What lies at the target follows the pointer, by pixels.
  pan(right, down) {
    const step = this.orbit.distance / this.focal();
    this.orbit.move(-right * step, -down * step, 0);
  }

  wheel(event) {
    event.preventDefault();
    this.halt();
    const lines = event.deltaMode === 1 ? 16 : 1;
    this.orbit.zoom(Math.exp(Math.max(-120, Math.min(120, lines * event.deltaY)) * WHEEL), this.nearest);
    this.changed();
  }

  key(event) {
    if (event.target.matches("input") || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.code])
      return;
    event.preventDefault();
    this.halt();
    this.pressed.add(event.code);
    this.changed();
  }

  // Fly to a view {eye, turn} whose subject is at `distance`; at once where people want no motion.
  fly(view, distance, milliseconds = FLIGHT) {
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const from = { eye: this.orbit.eye, turn: this.orbit.turn, distance: this.orbit.distance };
    if (calm) this.orbit.set(view, distance);
    else this.flight = { from, view, distance, milliseconds, passed: 0 };
    this.changed();
  }

  // Go on by so many milliseconds; whether there is more to come.
  step(elapsed) {
    if (this.flight) this.soar(elapsed);
    for (const code of this.pressed) this.held(KEYS[code], elapsed / 1000);
    return this.busy;
  }

  get busy() {
    return this.flight !== null || this.pressed.size > 0;
  }

  held([what, ...signs], seconds) {
    if (what === "orbit") this.orbit.orbit(...signs.map((sign) => sign * RATES.turn * seconds));
    if (what === "move")
      this.orbit.move(...signs.map((sign) => sign * RATES.move * seconds * this.orbit.distance));
    if (what === "zoom") this.orbit.zoom(Math.exp(signs[0] * RATES.zoom * seconds), this.nearest);
  }

  soar(elapsed) {
    const { from, view, distance, milliseconds } = this.flight;
    this.flight.passed += elapsed;
    const share = Math.min(1, this.flight.passed / milliseconds);
    const eased = share * share * (3 - 2 * share);
    const between = (a, b) => a.map((value, axis) => value + eased * (b[axis] - value));
    const forward = unit(between(from.turn[2], view.turn[2]));
    const right = between(from.turn[0], view.turn[0]);
    const level = unit(plus(right, forward, -dot(right, forward)));
    const eye = between(from.eye, view.eye);
    this.orbit.set(
      { eye, turn: [level, cross(forward, level), forward] },
      between([from.distance], [distance])[0],
    );
    if (share === 1) this.flight = null;
  }
}
