// The plan: the scene from straight above, without what is higher than the photos' eyes; where one is, and the stops.
// It is drawn once a scene, from so far that its rays are parallel.

const FAR = 40; // times half the plan's side
const CORE = [0.02, 0.98]; // of the Gaussians along each axis: stray ones do not count
const MARGIN = 1.08;

class Plan {
  // visit(place): a stop was chosen.
  constructor(visit) {
    this.visit = visit;
    this.box = find("plan");
    this.picture = find("above");
    this.marks = find("marks");
  }

  get open() {
    return !this.box.hidden;
  }

  toggle(open, world) {
    this.box.hidden = !open;
    find("planner").setAttribute("aria-pressed", open);
    if (open && this.world !== world) this.draw(world);
  }

  // The picture, the stops' numbers and how long a metre is.
  draw(world) {
    this.world = world;
    this.view = this.above(world);
    const side = this.picture.width;
    const target = world.drawing.target([side, side], 0);
    world.drawing.splat(target, this.view, this.lens(side), null, this.view.near);
    const texels = world.drawing.read(target, 0);
    world.drawing.release(target);
    const bytes = Uint8ClampedArray.from(texels, (value, i) => {
      const alpha = texels[i - (i % 4) + 3];
      return 255 * (i % 4 === 3 ? alpha : value / Math.max(alpha, 1e-3));
    });
    this.picture.getContext("2d").putImageData(new ImageData(bytes, side, side), 0, 0);
    this.marks.replaceChildren(...world.header.stops.map((stop, place) => this.mark(stop, place)));
    const metre = world.header.metric && 0.5 / this.view.half / MARGIN / world.header.metric;
    find("metre").hidden = !metre || metre > 0.9;
    find("metre").style.width = `${100 * metre}%`;
  }

  // A camera over the middle of the scene, the first photo's way ahead upwards: {eye, turn, near, half}.
  above(world) {
    const {
      texels,
      header: { views },
    } = world;
    const down = unit(world.header.down);
    const right = unit(plus(views[0].turn[0], down, -dot(views[0].turn[0], down)));
    const turn = [right, cross(down, right), down];
    const places = [[], [], []];
    for (let at = 0; at < texels.length; at += 16) {
      if (texels[at + 3] < SOLID) continue;
      const place = [texels[at], texels[at + 1], texels[at + 2]];
      for (const [i, axis] of turn.entries()) places[i].push(dot(place, axis));
    }
    const spans = places.map((values, i) => {
      const sorted = Float32Array.from(values).sort();
      const core = CORE.map((share) => sorted[Math.floor(share * (sorted.length - 1))] ?? 0);
      const stood = views.map((view) => dot(view.eye, turn[i])); // where photos were taken is on it, too
      return i === 2 ? core : [Math.min(core[0], ...stood), Math.max(core[1], ...stood)];
    });
    const half = Math.max(spans[0][1] - spans[0][0], spans[1][1] - spans[1][0], 1e-3) / 2;
    const middle = spans.map(([low, high]) => (low + high) / 2);
    const eyes = views.map((view) => dot(view.eye, down)).sort((a, b) => a - b);
    const cut = Math.min(eyes[Math.floor(eyes.length / 2)], middle[2]);
    const eye = turn.reduce(
      (sum, axis, i) => plus(sum, axis, middle[i] - (i === 2 ? FAR * half : 0)),
      [0, 0, 0],
    );
    return { eye, turn, half, near: cut - middle[2] + FAR * half };
  }

  lens(side) {
    const focal = (FAR * side) / 2 / MARGIN;
    return { pinhole: [focal, focal, side / 2, side / 2], size: [side, side] };
  }

  // Where a point is on the plan, shares of its sides.
  place(point) {
    const [x, y] = pixel(point, this.view, this.lens(1), 1);
    return [x, y].map((value) => Math.max(0.02, Math.min(0.98, value)));
  }

  mark(stop, place) {
    const button = element("button", String(place + 1), {
      title: stop.name,
      "aria-label": `stop ${place + 1}: ${stop.name}`,
    });
    const [x, y] = this.place(stop.eye);
    Object.assign(button.style, { left: `${100 * x}%`, top: `${100 * y}%` });
    button.addEventListener("click", () => this.visit(place));
    return button;
  }

  // The arrow where one is.
  here(orbit) {
    if (!this.open) return;
    const [x, y] = this.place(orbit.eye);
    const [right, back] = [0, 1].map((axis) => dot(orbit.turn[2], this.view.turn[axis]));
    const angle = Math.atan2(right, -back);
    find("here").style.transform =
      `translate(${(100 * x).toFixed(1)}cqw, ${(100 * y).toFixed(1)}cqw) rotate(${angle.toFixed(3)}rad)`;
  }
}
