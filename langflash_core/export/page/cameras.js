// Cameras: OpenCV axes (+x right, +y down, +z forward), rows of `turn` are these axes in the world, lengths in
// scene units around the page's origin. A lens is {pinhole: [fx, fy, cx, cy], size: [width, height]}, pixels.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b, scale = 1) => a.map((value, axis) => value + scale * b[axis]);
const length = (a) => Math.hypot(...a);
const unit = (a) => a.map((value) => value / Math.max(length(a), 1e-12));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// `a` turned about a unit axis by an angle in radians (Rodrigues).
function turned(a, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return plus(
    plus(
      a.map((value) => c * value),
      cross(axis, a),
      s,
    ),
    axis,
    (1 - c) * dot(axis, a),
  );
}

// Gains and offsets of the light of a place, as langflash_core/scene/exposure.py has it: the photos' around it.
function lightAt({ views, light }, { eye, turn }) {
  if (!light)
    return [
      [1, 1, 1],
      [0, 0, 0],
    ];
  const squares = views.map((view) => {
    const angle = 2 * Math.asin(Math.min(1, length(plus(turn[2], view.turn[2], -1)) / 2));
    return angle ** 2 + (length(plus(eye, view.eye, -1)) / light.distance) ** 2;
  });
  const weights = squares.map((square) => 1 / (square + light.here ** 2));
  const total = weights.reduce((sum, weight) => sum + weight, 1 / light.far ** 2);
  const mean = (rows, of) =>
    [0, 1, 2].map((channel) => weights.reduce((sum, w, v) => sum + w * of(rows[v][channel]), 0) / total);
  return [mean(light.gains, Math.log).map(Math.exp), mean(light.offsets, (offset) => offset)];
}

// A lens for another size that shows the whole of the photo, and `more` times as much magnified.
function fitted(lens, [width, height], more = 1) {
  const scale = more * Math.min(width / lens.size[0], height / lens.size[1]);
  const [fx, fy, cx, cy] = lens.pinhole.map((value) => scale * value);
  const middle = [(width - scale * lens.size[0]) / 2, (height - scale * lens.size[1]) / 2];
  return { pinhole: [fx, fy, cx + middle[0], cy + middle[1]], size: [width, height] };
}

// How much more a photo is magnified on a screen of another shape: halfway between all of it and no bars.
function magnified([width, height], [photoWidth, photoHeight]) {
  const ratio = (width / height) * (photoHeight / photoWidth);
  return Math.min(Math.sqrt(Math.max(ratio, 1 / ratio)), 1.6);
}

const LEAST_TILT = 0.15; // radians that are left between the way one looks and straight up or down

// A camera that turns around a point ahead of it.
class Orbit {
  constructor(view, distance) {
    this.down = unit(view.turn[1]);
    this.set(view, distance);
  }

  set(view, distance) {
    this.turn = view.turn.map(unit);
    this.distance = distance;
    this.target = plus(view.eye, this.turn[2], distance);
  }

  get eye() {
    return plus(this.target, this.turn[2], -this.distance);
  }

  // Around the target, by angles in radians: sideways about the world's down, up and down about the own right.
  orbit(sideways, tilt) {
    const now = Math.acos(Math.max(-1, Math.min(1, dot(this.turn[2], this.down))));
    const room = [now - (Math.PI - LEAST_TILT), now - LEAST_TILT]; // of angles away from down
    const right = this.turn[0];
    const allowed = Math.max(Math.min(tilt, Math.max(room[1], 0)), Math.min(room[0], 0));
    this.turn = this.turn.map((axis) => unit(turned(turned(axis, right, -allowed), this.down, sideways)));
  }

  // The camera itself turns; what it looks at changes.
  look(sideways, tilt) {
    const eye = this.eye;
    this.orbit(sideways, tilt);
    this.target = plus(eye, this.turn[2], this.distance);
  }

  // By lengths along the camera's own axes.
  move(right, down, forward) {
    for (const [axis, step] of [right, down, forward].entries())
      this.target = plus(this.target, this.turn[axis], step);
  }

  // Nearer (factor below 1) or farther; what is very near is pushed along.
  zoom(factor, nearest) {
    const wanted = this.distance * factor;
    this.distance = Math.max(wanted, nearest);
    if (wanted < nearest) this.move(0, 0, nearest - wanted);
  }

  // Another point to turn around, without a change of the picture's middle at once.
  aim(point) {
    const eye = this.eye;
    this.turn[2] = unit(plus(point, eye, -1));
    this.turn[0] = unit(cross(this.down, this.turn[2]));
    this.turn[1] = cross(this.turn[2], this.turn[0]);
    this.target = point;
    this.distance = length(plus(point, eye, -1));
  }
}
