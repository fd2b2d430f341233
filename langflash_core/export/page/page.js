// The page: draws on demand, answers when the camera rests.

const MOST_PIXELS = 2.1e6; // of a picture
const REST = 160; // milliseconds without a movement
const SLOW = 40,
  QUICK = 22; // milliseconds a frame, beyond which moving pictures get fewer or more pixels
const LEAST_SCALE = 0.35;

const find = (id) => document.getElementById(id);
const hideAll = (which, hidden) => {
  for (const part of document.querySelectorAll(which)) part.hidden = hidden;
};

class Page {
  // world: the first scene; `add` brings others.
  constructor(world) {
    this.canvas = find("stage");
    this.worlds = [world];
    this.world = world;
    this.scale = 1; // of the picture's sides while it moves
    this.pace = QUICK; // milliseconds a frame, on average
    this.heat = true;
    this.carried = null;
    this.orbit = new Orbit(world.start, world.start.distance);
    this.orbit.down = unit(world.header.down);
    this.moving = new Moving(this.canvas, this.orbit, 0.05 * this.orbit.distance, {
      focal: () => this.shown(1).pinhole[0] / this.ratio,
      changed: () => this.moved(),
      aimed: (x, y) => this.aim(x, y),
      taken: () => this.touring.stop(),
    });
    this.asking =
      this.answers &&
      new Asking(this.answers.texts, [...Array(this.answers.asked).keys()], {
        changed: () => this.asked(),
        learn: find("tower") && ((text) => this.learn(text)),
      });
    this.touring = new Touring((stop, milliseconds) => this.arrive(stop, milliseconds));
    this.notes = new Notes({ chosen: (note) => this.ask(note.phrase), reached: (note) => this.turnTo(note) });
    this.plan = new Plan((place) => this.touring.go(place));
    this.embedding = new Embedding(this);
    this.furnish();
    addEventListener("resize", () => this.resize());
    this.canvas.addEventListener("webglcontextlost", () => location.reload());
    this.resize();
  }

  get header() {
    return this.world.header;
  }
  get drawing() {
    return this.world.drawing;
  }
  get answers() {
    return this.world.answers;
  }
  get lens() {
    return this.world.lens;
  }

  // Buttons, keys and what the address says.
  furnish() {
    for (const name of ["photo", "heat"])
      find(name).addEventListener("click", () => this.setHeat(name === "heat"));
    find("credit").hidden = !find("tower");
    hideAll(".asking", !this.answers);
    find("helper").addEventListener("click", () => this.help());
    find("help").addEventListener("click", () => find("help").close());
    find("planner").addEventListener("click", () => this.showPlan(!this.plan.open));
    find("noter").addEventListener("click", () =>
      this.showNotes(document.body.classList.contains("unnoted")),
    );
    addEventListener("keydown", (event) => this.key(event));
    this.enter(this.world);
    const stops = this.header.stops.map(({ name }) => name);
    const texts = this.answers ? this.answers.texts : [];
    const said = readAddress(location.hash, this.header.views.length, stops, texts);
    document.body.classList.toggle("bare", said.bare);
    const place = this.header.stops[said.stop] ?? this.header.views[said.view];
    if (place) {
      this.orbit.set(place, place.distance ?? this.world.depth(place));
      this.touring.show(this.header.stops, said.stop);
    }
    if (said.row >= 0) this.asking.ask(said.row);
    else if (this.answers?.asked) this.asking.choose(0);
    this.setHeat(said.heat);
    if (said.plan) this.showPlan(true);
  }

  // What belongs to one scene: its title, photos, stops and notes.
  enter(world) {
    const { header } = world;
    this.world = world;
    document.title = find("title").textContent = header.title;
    find("views").replaceChildren(
      ...header.views.map((_, index) => {
        const button = element("button", String(index + 1), {
          title: `photo ${index + 1}`,
          "aria-label": `photo ${index + 1}`,
        });
        button.addEventListener("click", () => this.visit(index));
        return button;
      }),
    );
    this.touring.show(header.stops, header.stops.length && header.start !== undefined ? header.start : -1);
    this.notes.show(world);
    find("noter").hidden = !header.notes.length;
    hideAll(".touring", !header.stops.length);
    hideAll(".noting", !header.notes.length);
    if (this.plan.open) this.plan.toggle(true, world);
  }

  // Another scene of the page, with the phrase that is asked.
  change(world) {
    if (world === this.world) return;
    this.enter(world);
    this.orbit.down = unit(world.header.down);
    this.orbit.set(world.start, world.start.distance);
    this.moving.nearest = 0.05 * this.orbit.distance;
    this.moving.flight = null;
    if (this.asking) this.asking.forget();
    this.asked();
    this.listRooms();
  }

  // One more scene that the page holds.
  add(world) {
    this.worlds.push(world);
    this.listRooms();
    this.moved();
  }

  // The scenes, each with what it says to the chosen phrase.
  listRooms() {
    find("rooms").hidden = this.worlds.length < 2;
    if (this.worlds.length < 2) return;
    const row = this.asking ? this.asking.chosen : null;
    find("rooms").replaceChildren(
      ...this.worlds.map((world) => {
        const button = element("button", world.header.title, { "aria-pressed": world === this.world });
        const best = row === null ? null : world.found.get(row);
        if (row !== null) button.dataset.state = !best ? "pending" : best.found ? "found" : "missing";
        if (best)
          button.setAttribute("aria-label", `${world.header.title}: ${best.found ? "found" : "not found"}`);
        button.addEventListener("click", () => this.change(world));
        return button;
      }),
    );
  }

  // Ask one more scene, if there is one that was not asked yet.
  askOthers() {
    const row = this.asking.chosen;
    const world = this.worlds.find((other) => row !== null && other.answers && !other.found.has(row));
    if (!world || this.worlds.length < 2) return;
    world.best(row);
    this.listRooms();
    this.others = setTimeout(() => this.askOthers(), 0);
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
    else if (event.key === "p") this.showPlan(!this.plan.open);
    else if (event.key === "n" && this.header.notes.length)
      this.showNotes(document.body.classList.contains("unnoted"));
    else if (event.key === "t" && this.header.stops.length)
      this.touring.timer ? this.touring.stop() : this.touring.play();
    else if (event.key === "PageDown") this.touring.step(1);
    else if (event.key === "PageUp") this.touring.step(-1);
  }

  showPlan(open) {
    this.plan.toggle(open, this.world);
    this.request();
  }

  showNotes(shown) {
    document.body.classList.toggle("unnoted", !shown);
    find("noter").setAttribute("aria-pressed", shown);
  }

  // A stop: its view, and its phrase.
  arrive(stop, milliseconds) {
    this.moving.fly(stop, stop.distance, milliseconds);
    if (stop.phrase) this.ask(stop.phrase);
    else if (this.asking) this.asking.choose(null);
    this.embedding.say("stop", { name: stop.name });
  }

  // A phrase by its text; nothing where the page does not know it.
  async ask(text) {
    if (!text || !this.answers) return;
    const row = this.answers.texts.indexOf(text);
    if (row >= 0) this.asking.ask(row);
    else if (find("tower")) this.asking.ask(await this.learn(text));
  }

  // The camera where it is, turned to a note.
  turnTo(note) {
    const there = new Orbit({ eye: this.orbit.eye, turn: this.orbit.turn }, 1);
    there.down = this.orbit.down;
    there.aim(note.at);
    this.moving.fly({ eye: there.eye, turn: there.turn }, there.distance);
  }

  // At once to a camera of the scene's own world, rows of world to camera.
  look(viewmat) {
    const turn = viewmat.slice(0, 3).map((row) => row.slice(0, 3));
    const eye = [0, 1, 2].map((axis) => -turn.reduce((sum, row, i) => sum + row[axis] * viewmat[i][3], 0));
    const view = { turn, eye: plus(eye, this.header.origin, -1) };
    this.moving.flight = null;
    this.orbit.set(view, this.world.depth(view));
    this.moved();
  }

  help() {
    find("help").open ? find("help").close() : find("help").showModal();
  }

  visit(index) {
    const view = this.header.views[index];
    this.moving.fly(view, this.world.depth(view));
  }

  // Turn around what lies under a place of the canvas, in the page's pixels.
  aim(x, y) {
    const lens = this.shown(1);
    const place = [x * this.ratio, y * this.ratio];
    const view = { eye: this.orbit.eye, turn: this.orbit.turn };
    const depths = this.world.depthsAround(view, lens, place, 0.015 * lens.size[1] + 2);
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
    this.carried = row === null || !this.answers ? null : this.drawing.upload(this.answers.numbers([row]));
    this.lit = this.answers?.threshold;
    if (row !== null && !this.heat) this.setHeat(true);
    clearTimeout(this.others);
    this.listRooms();
    this.moved();
  }

  // The row of another phrase. The text tower is unpacked when it is first needed.
  async learn(text) {
    this.tower ??= Promise.all(["tower", "tokens"].map((name) => inflated(find(name).textContent))).then(
      ([weights, tokens]) => new TextTower(weights, new TextDecoder().decode(tokens).split("\n")),
    );
    const vector = (await this.tower).encode(text);
    return this.worlds.filter((world) => world.answers).map((world) => world.answers.learn(text, vector))[0];
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

  // Shows the chosen phrase from where its score says on.
  light(answer) {
    if (!answer || answer.lit === this.lit) return;
    this.lit = answer.lit;
    this.draw(1, true);
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

  // Every label's sight is judged where `all` is true, else one more of them.
  draw(scale, all = false) {
    const glows = this.heat && this.carried !== null;
    this.sharp = scale === 1;
    this.drawing.splat(this.target, this.orbit, this.shown(scale), glows ? this.carried : null);
    this.drawing.show(this.target, glows ? { ...this.answers, threshold: this.lit } : null);
    this.notes.place(this.orbit, this.shown(1), this.ratio, all);
    this.plan.here(this.orbit);
  }

  // The camera stands still: all pixels, and scores. Not while it flies and the next frame is late: a full
  // picture before every frame would keep slow machines from ever getting anywhere.
  rest() {
    if (this.moving.busy) {
      this.resting = setTimeout(() => this.rest(), REST);
      return;
    }
    this.last = undefined;
    this.draw(1, true);
    this.embedding.camera();
    if (!this.asking || !this.answers) return;
    const answers = this.judge(this.asking.asked, this.shown(this.judgedScale()));
    this.light(answers.get(this.asking.chosen));
    this.asking.answer(answers);
    const told = [...answers].map(([row, { found, score }]) => ({
      phrase: this.answers.texts[row],
      found,
      score,
    }));
    this.embedding.say("answers", { answers: told });
    this.askOthers();
  }

  judgedScale() {
    return Math.min(1, Math.sqrt(MOST_JUDGED / (this.canvas.width * this.canvas.height)));
  }

  judge(rows, lens, camera = this.orbit) {
    return this.world.judge(rows, lens, camera);
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
