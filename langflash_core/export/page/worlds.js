// One scene of the page: its Gaussians, what draws and answers them, and what can be seen of a point. A page may hold
// several, which share the canvas and the phrases.

const MOST_JUDGED = 320 * 320; // pixels that scores are taken from
const MOST_VIEWS = 8; // of another scene that are looked through for a phrase
const SURFACE = 0.03; // of the distance to a point: what is nearer to it than that is its own surface
const SOLID = 0.3; // opacity

class World {
  // header, columns: as decode.js has them.
  constructor(canvas, header, columns) {
    this.header = header;
    this.texels = gaussianTexels(header, columns);
    this.drawing = new Drawing(canvas, header, this.texels, paletteTexels(header, columns));
    const phrases = readPhrases(header, columns);
    this.answers = phrases && new Answers(phrases, header.count);
    this.lens = { pinhole: header.views[0].pinhole, size: header.viewSize };
    this.found = new Map(); // by row: the best answer of any photo's view
  }

  // Where it opens: {eye, turn, distance}.
  get start() {
    return (
      this.header.stops[this.header.start] || {
        ...this.header.views[0],
        distance: this.depth(this.header.views[0]),
      }
    );
  }

  // The middle depth of what lies near the middle of a view; 1 where nothing does.
  depth(view) {
    const [width, height] = this.lens.size;
    const near = this.depthsAround(view, this.lens, [width / 2, height / 2], 0.12 * Math.min(width, height));
    return near.length ? near[Math.floor(near.length / 2)] : 1;
  }

  // Depths, nearest first, of the solid Gaussians within so many pixels of a place.
  depthsAround(view, lens, [x, y], radius) {
    const { texels } = this;
    const [fx, fy, cx, cy] = lens.pinhole;
    const depths = [];
    for (let at = 0; at < texels.length; at += 16) {
      const offset = [texels[at] - view.eye[0], texels[at + 1] - view.eye[1], texels[at + 2] - view.eye[2]];
      const z = dot(offset, view.turn[2]);
      if (z < NEAR || texels[at + 3] < SOLID) continue;
      const off = [
        (dot(offset, view.turn[0]) / z) * fx + cx - x,
        (dot(offset, view.turn[1]) / z) * fy + cy - y,
      ];
      if (Math.hypot(...off) < radius) depths.push(z);
    }
    return depths.sort((a, b) => a - b);
  }

  // How much of the light of a point passes what lies before it, in [0, 1]: each Gaussian takes
  // o exp(-d / 2), d the least squared distance in its own deviations from the ray to its mean.
  light(eye, point) {
    const { texels } = this;
    const way = plus(point, eye, -1);
    const far = length(way),
      [wx, wy, wz] = way.map((value) => value / far);
    const end = (1 - SURFACE) * far;
    let passes = 1;
    for (let at = 0; at < texels.length && passes > 0.01; at += 16) {
      const x = texels[at] - eye[0],
        y = texels[at + 1] - eye[1],
        z = texels[at + 2] - eye[2];
      const along = x * wx + y * wy + z * wz;
      if (along < NEAR || along > end) continue;
      const reach = 3 * Math.max(texels[at + 8], texels[at + 9], texels[at + 10]);
      if (x * x + y * y + z * z - along * along > reach * reach) continue;
      passes *= 1 - texels[at + 3] * Math.exp(-0.5 * this.deviations(at, [x, y, z], [wx, wy, wz]));
    }
    return passes;
  }

  // Least squared distance, in deviations, of the ray t w from the Gaussian at `offset`.
  deviations(at, offset, way) {
    const inside = (vector) => {
      const [w, ...axis] = this.texels.subarray(at + 4, at + 8);
      const minus = axis.map((value) => -value); // the inverse rotation: q^-1 v q
      const twice = cross(minus, vector).map((value) => 2 * value);
      return plus(plus(vector, twice, w), cross(minus, twice)).map(
        (value, i) => value / this.texels[at + 8 + i],
      );
    };
    const [o, w] = [inside(offset), inside(way)];
    const t = dot(o, w) / dot(w, w);
    return dot(o, o) - t * t * dot(w, w);
  }

  // {score, found, area, relevance} by row, of phrases in the picture of a lens.
  judge(rows, lens, camera) {
    const answers = new Map();
    for (let first = 0; first < rows.length; first += PHRASES_A_PASS) {
      const some = rows.slice(first, first + PHRASES_A_PASS);
      const numbers = this.drawing.upload(this.answers.numbers(some));
      const target = this.drawing.target(lens.size, numbers.layers);
      this.drawing.splat(target, camera, lens, numbers);
      const read = target.textures.map((_, place) => this.drawing.read(target, place));
      const alpha = new Float32Array(read[0].length / 4).map((_, pixel) => read[0][4 * pixel + 3]);
      some.forEach((row, place) => {
        const [layer, channel] = [1 + Math.floor((place + 1) / 3), (place + 1) % 3];
        const relevance = alpha.map((_, pixel) => {
          return this.answers.relevance(read[1][4 * pixel], read[layer][4 * pixel + channel]);
        });
        answers.set(row, { ...judged(relevance, alpha, this.answers), relevance });
      });
      this.drawing.drop(numbers);
      this.drawing.release(target);
    }
    return answers;
  }

  // {found, score, view} of a phrase in the photo's view that answers it best; drawn once.
  best(row) {
    if (!this.found.has(row)) {
      const [width, height] = this.lens.size;
      const scale = Math.min(1, Math.sqrt(MOST_JUDGED / 4 / (width * height)));
      const lens = fitted(
        this.lens,
        [width, height].map((side) => Math.max(1, Math.round(scale * side))),
      );
      const answers = this.header.views.slice(0, MOST_VIEWS).map((view, index) => {
        const { found, score } = this.judge([row], lens, view).get(row);
        return { found, score, view: index };
      });
      this.found.set(
        row,
        answers.reduce((a, b) => ((b.found - a.found || b.score - a.score) > 0 ? b : a)),
      );
    }
    return this.found.get(row);
  }
}
