// Puts the page together: reads the scene, draws on demand, answers when the camera rests.
// The address may say more: #view=1&ask=plant&mode=photo&bare

const MOST_PIXELS = 2.1e6; // of a picture
const MOST_JUDGED = 320 * 320; // pixels that scores are taken from
const REST = 160; // milliseconds without a movement
const SLOW = 40,
  QUICK = 22; // milliseconds a frame, beyond which moving pictures get fewer or more pixels
const LEAST_SCALE = 0.35;

const find = (id) => document.getElementById(id);

// The middle depth of what lies near the middle of a view; 1 where nothing does.
function middleDepth(texels, view, lens) {
  const [width, height] = lens.size;
  const near = depthsAround(texels, view, lens, [width / 2, height / 2], 0.12 * Math.min(width, height));
  return near.length ? near[Math.floor(near.length / 2)] : 1;
}

// Depths, nearest first, of the solid Gaussians within so many pixels of a place.
function depthsAround(texels, view, lens, [x, y], radius) {
  const [fx, fy, cx, cy] = lens.pinhole;
  const depths = [];
  for (let at = 0; at < texels.length; at += 16) {
    const offset = [texels[at] - view.eye[0], texels[at + 1] - view.eye[1], texels[at + 2] - view.eye[2]];
    const z = dot(offset, view.turn[2]);
    if (z < NEAR || texels[at + 3] < 0.3) continue;
    const off = [
      (dot(offset, view.turn[0]) / z) * fx + cx - x,
      (dot(offset, view.turn[1]) / z) * fy + cy - y,
    ];
    if (Math.hypot(...off) < radius) depths.push(z);
  }
  return depths.sort((a, b) => a - b);
}

class Page {
  constructor(header, columns) {
    this.header = header;
    this.canvas = find("stage");
    this.texels = gaussianTexels(header, columns);
    this.drawing = new Drawing(this.canvas, header, this.texels, paletteTexels(header, columns));
    const phrases = readPhrases(header, columns);
    this.answers = phrases && new Answers(phrases, header.count);
    this.lens = { pinhole: header.views[0].pinhole, size: header.viewSize };
    this.scale = 1; // of the picture's sides while it moves
    this.pace = QUICK; // milliseconds a frame, on average
    this.heat = true;
    this.carried = null;
    const distance = middleDepth(this.texels, header.views[0], this.lens);
    this.orbit = new Orbit(header.views[0], distance);
    this.moving = new Moving(this.canvas, this.orbit, 0.05 * distance, {
      focal: () => this.shown(1).pinhole[0] / this.ratio,
      changed: () => this.moved(),
      aimed: (x, y) => this.aim(x, y),
    });
    this.asking =
      this.answers &&
      new Asking(phrases.texts, [...Array(phrases.asked).keys()], {
        changed: () => this.asked(),
        learn: find("tower") && ((text) => this.learn(text)),
      });
    this.furnish();
    addEventListener("resize", () => this.resize());
    this.canvas.addEventListener("webglcontextlost", () => location.reload());
    this.resize();
  }

  // Buttons, keys and what the address says.
  furnish() {
    document.title = find("title").textContent = this.header.title;
    const views = this.header.views.map((_, index) => {
      const button = element("button", String(index + 1), { title: `photo ${index + 1}` });
      button.addEventListener("click", () => this.visit(index));
      return button;
    });
    find("views").append(...views);
    for (const name of ["photo", "heat"])
      find(name).addEventListener("click", () => this.setHeat(name === "heat"));
    find("credit").hidden = !find("tower");
    for (const part of document.querySelectorAll(".asking")) part.hidden = !this.answers;
    find("helper").addEventListener("click", () => this.help());
    find("help").addEventListener("click", () => find("help").close());
    addEventListener("keydown", (event) => this.key(event));
    const said = new URLSearchParams(location.hash.slice(1));
    document.body.classList.toggle("bare", said.has("bare"));
    this.orbit.set(this.header.views[said.get("view")] || this.header.views[0], this.orbit.distance);
    const row = this.answers ? this.answers.texts.indexOf(said.get("ask")) : -1;
    if (row >= 0) this.asking.ask(row);
    else if (this.answers?.asked) this.asking.choose(0);
    this.setHeat(said.get("mode") !== "photo");
  }

  key(event) {
    if (event.target.matches("input") || event.ctrlKey || event.metaKey || event.altKey) return;
    const view = Number(event.key) - 1;
    if (this.header.views[view]) this.visit(view);
    else if (event.key === "h" && this.answers) this.setHeat(!this.heat);
    else if (event.key === "/" && this.answers) {
      event.preventDefault();
      find("box").focus();
    } else if (event.key === "?") this.help();
  }

  help() {
    find("help").open ? find("help").close() : find("help").showModal();
  }

  visit(index) {
    const view = this.header.views[index];
    this.moving.fly(view, middleDepth(this.texels, view, this.lens));
  }

  // Turn around what lies under a place of the canvas, in the page's pixels.
  aim(x, y) {
    const lens = this.shown(1);
    const place = [x * this.ratio, y * this.ratio];
    const view = { eye: this.orbit.eye, turn: this.orbit.turn };
    const depths = depthsAround(this.texels, view, lens, place, 0.015 * lens.size[1] + 2);
    if (!depths.length) return;
    const depth = depths[Math.floor(depths.length / 5)];
    const [fx, fy, cx, cy] = lens.pinhole;
    const slopes = [(place[0] - cx) / fx, (place[1] - cy) / fy, 1];
    const point = slopes.reduce((sum, slope, axis) => plus(sum, view.turn[axis], slope * depth), view.eye);
    const there = new Orbit(view, 1);
    there.down = this.orbit.down;
    there.aim(point);
    this.moving.fly({ eye: there.eye, turn: there.turn }, there.distance);
  }

  setHeat(heat) {
    this.heat = heat;
    find("heat").setAttribute("aria-pressed", heat);
    find("photo").setAttribute("aria-pressed", !heat);
    this.request();
  }

  // Another phrase, or another one chosen: the Gaussians carry other numbers.
  asked() {
    if (this.carried) this.drawing.drop(this.carried);
    const row = this.asking.chosen;
    this.carried = row === null ? null : this.drawing.upload(this.answers.numbers([row]));
    if (row !== null && !this.heat) this.setHeat(true);
    this.moved();
  }

  // The row of another phrase. The text tower is unpacked when it is first needed.
  async learn(text) {
    this.tower ??= Promise.all(["tower", "tokens"].map((name) => inflated(find(name).textContent))).then(
      ([weights, tokens]) => new TextTower(weights, new TextDecoder().decode(tokens).split("\n")),
    );
    return this.answers.learn(text, (await this.tower).encode(text));
  }

  // --- sizes ---

  resize() {
    const wanted = [this.canvas.clientWidth, this.canvas.clientHeight].map((side) => Math.max(1, side));
    const most = Math.sqrt(MOST_PIXELS / (wanted[0] * wanted[1]));
    this.ratio = Math.min(devicePixelRatio || 1, most);
    [this.canvas.width, this.canvas.height] = wanted.map((side) =>
      Math.max(1, Math.round(side * this.ratio)),
    );
    if (this.target) this.drawing.release(this.target);
    this.target = this.drawing.target([this.canvas.width, this.canvas.height], 1);
    this.moved();
  }

  // The lens of the canvas, with `scale` times as many pixels a side.
  shown(scale) {
    const size = [this.canvas.width, this.canvas.height].map((side) => Math.max(1, Math.round(scale * side)));
    return fitted(this.lens, size, magnified(size, this.lens.size));
  }

  // --- frames ---

  moved() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.rest(), REST);
    this.request();
  }

  request() {
    this.waiting ??= requestAnimationFrame((time) => this.frame(time));
  }

  frame(time) {
    this.waiting = null;
    const elapsed = Math.min(time - (this.last ?? time), 500);
    this.last = time;
    this.pace += 0.2 * ((elapsed || this.pace) - this.pace);
    if (this.pace > SLOW) this.scale = Math.max(LEAST_SCALE, 0.9 * this.scale);
    else if (this.pace < QUICK) this.scale = Math.min(1, 1.05 * this.scale);
    const more = this.moving.step(elapsed);
    this.draw(this.scale);
    if (more) this.moved();
  }

  draw(scale) {
    const glows = this.heat && this.carried !== null;
    this.sharp = scale === 1;
    this.drawing.splat(this.target, this.orbit, this.shown(scale), glows ? this.carried : null);
    this.drawing.show(this.target, glows ? this.answers : null);
  }

  // The camera stands still: all pixels, and scores.
  rest() {
    this.last = undefined;
    if (!this.sharp) this.draw(1);
    if (this.asking) this.asking.answer(this.judge(this.asking.asked, this.shown(this.judgedScale())));
  }

  judgedScale() {
    return Math.min(1, Math.sqrt(MOST_JUDGED / (this.canvas.width * this.canvas.height)));
  }

  // {score, found, area, relevance} by row, of phrases in the picture of a lens.
  judge(rows, lens, camera = this.orbit) {
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
        answers.set(row, { ...judged(relevance, alpha, this.answers.threshold), relevance });
      });
      this.drawing.drop(numbers);
      this.drawing.release(target);
    }
    return answers;
  }

  // A picture as numbers: colours (height, width, 4) float32, premultiplied; the answer to a phrase, if one is named.
  picture(view, size, phrase) {
    const lens = fitted(this.lens, size);
    const target = this.drawing.target(size, 0);
    this.drawing.splat(target, this.header.views[view], lens, null);
    const colours = this.drawing.read(target, 0);
    this.drawing.release(target);
    const row = phrase === undefined ? -1 : this.answers.texts.indexOf(phrase);
    return { colours, answer: row < 0 ? null : this.judge([row], lens, this.header.views[view]).get(row) };
  }
}

async function open() {
  const header = JSON.parse(find("header").textContent);
  const columns = readColumns(header.columns, await inflated(find("payload").textContent));
  find("payload").remove();
  const page = new Page(header, columns);
  await new Promise(requestAnimationFrame);
  find("waiting").remove();
  return page;
}

// For programs that drive the page: a promise of it.
window.langflash = open();
window.langflash.catch((error) => {
  find("waiting").textContent = error.message;
});
