// Scenes of layers: which layers a camera sees, each a World of its own, and what they say to phrases together.
// export/page_columns.py wrote them. Twin of the choice: langflash_core/splat/compose.py, whose constants these are.

const NEAREST = 4; // layers of a picture
const FLOOR = 0.05; // median distances and radians, together, within which no photo is nearer than another
const PLACE_STEPS = [32, 32, 4000]; // of a pixel across and down, of the logarithm of depth
const PHRASES_OF_LAYERS = 3 * (MOST_LAYERS - 1) - 1; // a pass: one layer of its numbers is the place
const SAMPLED = 16; // Gaussians of which one tells how large the scene is
const OF_ALL = ["palette", "scores", "negatives", "gram", "dictionary", "rivals"]; // columns with no row a Gaussian

// [{place, weight}] of the layers that a camera sees, the nearest first, in sum 1. photos: {eye, turn} of each.
function chosenLayers(photos, distance, { eye, turn }) {
  const far = photos.map((photo) => {
    const chord = Math.min(1, length(plus(turn[2], photo.turn[2], -1)) / 2);
    return length(plus(eye, photo.eye, -1)) / distance + 2 * Math.asin(chord) + FLOOR;
  });
  const order = [...far.keys()].sort((a, b) => far[a] - far[b]);
  const next = order.length > NEAREST ? far[order[NEAREST]] ** -2 : 0;
  const near = order.slice(0, NEAREST).map((place) => ({ place, weight: far[place] ** -2 - next }));
  const sum = near.reduce((total, { weight }) => total + weight, 0);
  if (!(sum > 0)) return near.map(({ place }) => ({ place, weight: 1 / near.length })); // all are as far
  return near
    .map(({ place, weight }) => ({ place, weight: weight / sum }))
    .filter(({ weight }) => weight > 0);
}

// {header, columns} of each layer, and of what no photo made in each, as decode.js reads those of a scene.
function separated(header, columns) {
  for (const axis of [0, 2])
    for (const [i, green] of columns.colour1.entries()) columns["colour" + axis][i] += green;
  Object.assign(columns, worldPlaces(header, columns));
  const owned = header.layers.reduce((sum, { count }) => sum + count, 0);
  let first = 0;
  return header.layers.map(({ count }) => {
    const own = {};
    for (const [name, values] of Object.entries(columns))
      own[name] = OF_ALL.includes(name) ? values : joined(values, first, first + count, owned);
    first += count;
    const phrases = header.phrases && { ...header.phrases, texts: [...header.phrases.texts] };
    const bounds = { lowest: [0, 0, 0], highest: [65535, 65535, 65535] }; // of means that are logarithms already
    return { header: { ...header, ...bounds, phrases, count: own.opacity.length }, columns: own };
  });
}

// Rows from first to end, and all from `rest` on.
function joined(values, first, end, rest) {
  if (rest === values.length) return values.subarray(first, end);
  const made = new values.constructor(end - first + values.length - rest);
  made.set(values.subarray(first, end));
  made.set(values.subarray(rest), end - first);
  return made;
}

// mean0 to mean2 of all Gaussians as logarithms around the origin, float64: out of the steps of those that are stored
// so, and of the places of others in the picture of their photo.
function worldPlaces(header, columns) {
  const means = [0, 1, 2].map(() => new Float64Array(header.count));
  const spans = header.highest.map((high, axis) => (high - header.lowest[axis]) / 65535);
  let row = 0;
  let placed = 0;
  let plain = 0;
  const stored = (count) => {
    for (const end = row + count; row < end; ++row, ++plain)
      for (let axis = 0; axis < 3; ++axis)
        means[axis][row] = header.lowest[axis] + spans[axis] * columns["mean" + axis][plain];
  };
  for (const { view, count, lowest } of header.layers)
    if (!lowest) stored(count);
    else {
      writePlaces(means, row, header.views[view], lowest, columns, placed, count);
      row += count;
      placed += count;
    }
  stored(header.count - row);
  return { mean0: means[0], mean1: means[1], mean2: means[2] };
}

// Means from `row` on, of `count` places from `first` on in the picture of a view.
function writePlaces(means, row, { turn, eye, pinhole }, lowest, columns, first, count) {
  const [fx, fy, cx, cy] = pinhole;
  for (let i = 0; i < count; ++i) {
    const [x, y, log] = PLACE_STEPS.map(
      (steps, axis) => (lowest[axis] + columns["place" + axis][first + i]) / steps,
    );
    const z = Math.exp(log);
    const [right, down] = [((x - cx) / fx) * z, ((y - cy) / fy) * z];
    for (let axis = 0; axis < 3; ++axis) {
      const place = eye[axis] + right * turn[0][axis] + down * turn[1][axis] + z * turn[2][axis];
      means[axis][row + i] = Math.sign(place) * Math.log1p(Math.abs(place));
    }
  }
}

// What all layers answer: has what Answers has. Numbers are made of the layers that are drawn, when they are.
class LayeredAnswers {
  // answers: of each layer.
  constructor(answers) {
    this.answers = answers;
    const { texts, asked, threshold, half, temperature } = answers[0];
    Object.assign(this, { texts, asked, threshold, half, temperature });
  }

  learn(text, vector) {
    return this.answers.map((one) => one.learn(text, vector))[0];
  }

  relevance(norm, difference) {
    return this.answers[0].relevance(norm, difference);
  }

  numbers(rows) {
    const of = (place) => this.answers[place].numbers(rows);
    return { of, layers: Math.ceil((1 + rows.length) / 3), uploaded: new Map() };
  }
}

class LayeredWorld extends World {
  // header, columns: of the whole scene. The World of the first layer is made as this one, then set apart.
  constructor(canvas, whole, all) {
    const [first, ...rest] = separated(whole, all);
    super(canvas, first.header, first.columns);
    const alone = Object.assign(Object.create(World.prototype), this);
    this.layers = [alone, ...rest.map(({ header, columns }) => new World(canvas, header, columns))];
    this.header = whole;
    this.photos = whole.layers.map(({ view }) => whole.views[view]);
    this.drawing = new LayeredDrawing(this.layers, this.photos, whole.distance);
    this.answers = this.answers && new LayeredAnswers(this.layers.map(({ answers }) => answers));
    this.texels = sampled(this.layers);
  }

  // The layer whose photo is nearest to a view.
  nearest(view) {
    return this.layers[chosenLayers(this.photos, this.header.distance, view)[0].place];
  }

  depthsAround(view, lens, place, radius) {
    return this.nearest(view).depthsAround(view, lens, place, radius);
  }

  light(eye, point) {
    return this.nearest({ eye, turn: [[], [], unit(plus(point, eye, -1))] }).light(eye, point);
  }

  judge(rows, lens, camera) {
    const answers = [];
    for (let first = 0; first < rows.length; first += PHRASES_OF_LAYERS)
      answers.push(...super.judge(rows.slice(first, first + PHRASES_OF_LAYERS), lens, camera));
    return new Map(answers);
  }
}

// Texels of some Gaussians of all layers, evenly.
function sampled(layers) {
  const some = layers.map(({ texels }) => Math.ceil(texels.length / 16 / SAMPLED));
  const made = new Float32Array(16 * some.reduce((sum, count) => sum + count, 0));
  let at = 0;
  for (const [place, { texels }] of layers.entries())
    for (let i = 0; i < some[place]; ++i, at += 16) {
      const from = 16 * SAMPLED * i;
      made.set(texels.subarray(from, from + 16), at);
    }
  return made;
}

// A page of which a scene has layers: whole pictures at rest, quicker ones while the camera moves.
class LayeredPage extends Page {
  moved() {
    this.still = false;
    super.moved();
  }

  draw(scale, all = false) {
    this.still ||= all; // what is drawn again at rest stays whole
    this.drawing.moving = !this.still;
    super.draw(this.still ? 1 : scale, all);
    this.drawing.moving = false;
  }

  // Numbers belong to the scene that drew them.
  change(world) {
    if (world === this.world) return;
    if (this.carried) this.drawing.drop(this.carried);
    this.carried = null;
    super.change(world);
  }

  enter(world) {
    super.enter(world);
    const { layers, views } = world.header;
    this.told ??= find("help").appendChild(element("p", ""));
    this.told.hidden = !layers;
    if (!layers) return;
    const held = layers.length < views.length ? `${layers.length} of ${views.length}` : `${layers.length}`;
    this.told.textContent = `Pictures are blended of the nearest photos’ layers; the page holds ${held}.`;
  }
}

// A scene of the page by its number; the first one has what all are drawn by.
async function world(number, first) {
  const header = { ...first, ...JSON.parse(find(`header${number || ""}`).textContent) };
  const columns = readColumns(header.columns, await inflated(find(`payload${number || ""}`).textContent));
  find(`payload${number || ""}`).remove();
  const kind = header.layers ? LayeredWorld : World;
  return new kind(find("stage"), header, columns);
}

async function open() {
  const page = new LayeredPage(await world(0, {}));
  await new Promise(requestAnimationFrame);
  find("waiting").remove();
  page.rooms = others(page);
  page.embedding.say("ready", { title: page.header.title, stops: page.header.stops.map(({ name }) => name) });
  return page;
}
