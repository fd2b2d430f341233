// The guided tour: from stop to stop, by hand or by itself. The bar tells where one is, also to those who listen.

const STAY = 3500,
  A_LETTER = 45; // milliseconds at a stop, and for every letter that is told there
const LEG = 1600; // milliseconds from stop to stop

class Touring {
  // visit(stop, milliseconds): fly there.
  constructor(visit) {
    this.visit = visit;
    this.bar = find("tour");
    this.stops = [];
    this.place = -1; // of the stop where one is; -1: none yet
    this.timer = null;
    find("back").addEventListener("click", () => this.step(-1));
    find("next").addEventListener("click", () => this.step(1));
    find("play").addEventListener("click", () => (this.timer ? this.stop() : this.play()));
  }

  // The stops of a scene, at one of them or at none.
  show(stops, place) {
    this.stop();
    this.stops = stops;
    this.place = place;
    this.bar.hidden = !stops.length;
    this.tell();
  }

  step(by) {
    this.stop();
    if (this.stops.length)
      this.go((Math.max(this.place, by > 0 ? -1 : 0) + by + this.stops.length) % this.stops.length);
  }

  go(place) {
    this.place = place;
    this.visit(this.stops[place], LEG);
    this.tell();
  }

  // From here to the end; from the end once more.
  play() {
    if (!this.stops.length) return;
    if (this.place + 1 >= this.stops.length || this.place < 0) this.go(0);
    else this.go(this.place + 1);
    this.waiting();
    this.tell();
  }

  waiting() {
    const { name, text } = this.stops[this.place];
    this.timer = setTimeout(
      () => {
        if (this.place + 1 >= this.stops.length) return this.stop();
        this.go(this.place + 1);
        this.waiting();
      },
      LEG + STAY + A_LETTER * (name.length + text.length),
    );
  }

  stop() {
    clearTimeout(this.timer);
    this.timer = null;
    this.tell();
  }

  tell() {
    const stop = this.stops[this.place];
    const playing = this.timer !== null;
    find("where").textContent = stop
      ? `${this.place + 1} of ${this.stops.length}`
      : `${this.stops.length} stops`;
    const [name, text] = stop ? [stop.name, stop.text] : ["A tour", "Go on to begin."];
    if (find("told").dataset.told !== name + text)
      find("told").replaceChildren(element("b", name), element("span", text));
    find("told").dataset.told = name + text;
    find("play").textContent = playing ? "❚❚" : "▶";
    find("play").setAttribute("aria-label", playing ? "stop the tour" : "play the tour");
  }
}
