// A page in a page: what is around it may say where to go and what to ask, and is told what comes of it. Messages are
// {langflash: word, ...}. In: go {stop | view | camera}, ask {phrase}, next, back, play, stop. Out: ready {scenes,
// stops, title}, camera {viewmat, K, width, height}, answers {answers: [{phrase, found, score}]}, stop {name}.
// Cameras are as `langflash render --camera` takes them, in the scene's own world.

class Embedding {
  constructor(page) {
    this.page = page;
    this.inside = parent !== window;
    if (!this.inside) return;
    addEventListener("message", (event) => event.source === parent && this.hear(event.data));
  }

  say(word, said) {
    if (this.inside) parent.postMessage({ langflash: word, ...said }, "*");
  }

  hear(said) {
    const { page } = this;
    const { touring } = page;
    if (typeof said !== "object" || said === null) return;
    if (said.langflash === "go") this.go(said);
    else if (said.langflash === "ask") page.ask(String(said.phrase));
    else if (said.langflash === "next") touring.step(1);
    else if (said.langflash === "back") touring.step(-1);
    else if (said.langflash === "play") touring.play();
    else if (said.langflash === "stop") touring.stop();
  }

  go({ stop, view, camera }) {
    const { page } = this;
    const place = page.header.stops.findIndex(({ name }, index) => name === stop || index === stop);
    if (place >= 0) page.touring.go(place);
    else if (page.header.views[view]) page.visit(view);
    else if (camera) page.look(camera.viewmat);
  }

  camera() {
    if (!this.inside) return;
    const { orbit, header } = this.page;
    const {
      pinhole: [fx, fy, cx, cy],
      size: [width, height],
    } = this.page.shown(1);
    const eye = plus(orbit.eye, header.origin);
    const viewmat = [...orbit.turn.map((axis) => [...axis, -dot(axis, eye)]), [0, 0, 0, 1]];
    this.say("camera", {
      viewmat,
      K: [
        [fx, 0, cx],
        [0, fy, cy],
        [0, 0, 1],
      ],
      width,
      height,
    });
  }
}
