// The panel: the box that completes phrases, and a chip for each that was asked.

const MOST_SUGGESTED = 6;

// Rows of the phrases that a typed text may mean, best first: whole, beginning, beginning of a word, inside.
function completions(texts, typed, without) {
  const sought = typed.trim().toLowerCase();
  const rank = (text) => {
    const at = text.indexOf(sought);
    if (at < 0) return 4;
    if (at === 0) return text === sought ? 0 : 1;
    return text[at - 1] === " " ? 2 : 3;
  };
  return texts
    .map((text, row) => [rank(text.toLowerCase()), text.length, row])
    .filter(([place, , row]) => sought && place < 4 && !without.includes(row))
    .sort((a, b) => a[0] - b[0] || a[1] - b[1])
    .slice(0, MOST_SUGGESTED)
    .map(([, , row]) => row);
}

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

class Asking {
  // texts: of all phrases. asked: rows of those that have a chip. changed(): another chip, or another one chosen.
  // learn(text): takes in another phrase, a promise of its row; null where the page cannot.
  constructor(texts, asked, { changed, learn }) {
    Object.assign(this, { texts, asked, changed, learn });
    this.chosen = null;
    this.answers = new Map(); // by row: {score, found}
    this.pointed = 0;
    this.rows = [];
    this.box = document.getElementById("box");
    this.list = document.getElementById("suggestions");
    this.chips = document.getElementById("chips");
    this.note = document.getElementById("note");
    this.box.addEventListener("input", () => this.suggest());
    this.box.addEventListener("keydown", (event) => this.key(event));
    this.box.addEventListener("blur", () => setTimeout(() => this.close(), 150));
    this.draw();
  }

  // A phrase of the list gets a chip and is shown.
  ask(row) {
    if (!this.asked.includes(row)) this.asked.push(row);
    this.box.value = "";
    this.close();
    this.choose(row);
  }

  choose(row) {
    this.chosen = row;
    this.draw();
    this.changed();
  }

  drop(row) {
    this.asked = this.asked.filter((other) => other !== row);
    this.choose(this.chosen === row ? null : this.chosen);
  }

  // What was answered is of another scene.
  forget() {
    this.answers = new Map();
    this.draw();
  }

  // What the picture on show answers, {score, found} by row.
  answer(answers) {
    this.answers = answers;
    this.draw();
  }

  suggest() {
    this.rows = completions(this.texts, this.box.value, this.asked);
    this.pointed = this.learn ? -1 : 0; // what is typed will do where any phrase will
    this.picked = false; // with the arrows
    const unknown = this.box.value.trim() && !this.rows.length && !this.learn && this.known() < 0;
    this.say(unknown ? `This page knows ${this.texts.length} phrases; this is none of them.` : "");
    this.listed();
  }

  // The row of what is typed; -1 where there is none.
  known() {
    const typed = this.box.value.trim().toLowerCase();
    return this.texts.findIndex((text) => text.toLowerCase() === typed);
  }

  listed() {
    this.list.replaceChildren(
      ...this.rows.map((row, place) => {
        const said = { role: "option", id: `option${place}`, "aria-selected": place === this.pointed };
        const item = element("li", this.texts[row], said);
        item.addEventListener("pointerdown", (event) => {
          event.preventDefault();
          this.ask(row);
        });
        return item;
      }),
    );
    this.list.hidden = !this.rows.length;
    this.box.setAttribute("aria-expanded", this.rows.length > 0);
    this.box.setAttribute("aria-activedescendant", this.rows.length ? `option${this.pointed}` : "");
  }

  close() {
    this.rows = [];
    this.say("");
    this.listed();
  }

  key(event) {
    const steps = { ArrowDown: 1, ArrowUp: -1 };
    if (event.key === "Escape") {
      this.close();
      this.box.blur();
    } else if (event.key === "Enter") this.enter();
    else if (steps[event.key] && this.rows.length) {
      event.preventDefault();
      this.pointed = (this.pointed + steps[event.key] + this.rows.length) % this.rows.length;
      this.picked = true;
      this.listed();
    }
  }

  async enter() {
    const [typed, known] = [this.box.value.trim(), this.known()];
    if (known >= 0 && !this.picked) this.ask(known);
    else if (this.rows.length && (this.picked || !this.learn)) this.ask(this.rows[this.pointed]);
    else if (this.learn && typed) {
      this.say("Reading …");
      try {
        this.ask(await this.learn(typed));
      } catch (error) {
        this.say(error.message);
      }
    }
  }

  say(sentence) {
    this.note.textContent = sentence;
    this.note.hidden = !sentence;
  }

  draw() {
    this.chips.replaceChildren(...this.asked.map((row) => this.chip(row)));
  }

  chip(row) {
    const answer = this.answers.get(row);
    const chip = element("div", "", { class: "chip" });
    chip.dataset.state = !answer ? "pending" : answer.found ? "found" : "missing";
    const body = element("button", this.texts[row], {
      "aria-pressed": row === this.chosen,
      title: "show where",
    });
    if (answer) body.append(element("small", (answer.found ? "" : "not found ") + answer.score.toFixed(2)));
    body.addEventListener("click", () => this.choose(row === this.chosen ? null : row));
    const gone = element("button", "×", { "aria-label": `remove ${this.texts[row]}`, class: "gone" });
    gone.addEventListener("click", () => this.drop(row));
    chip.append(body, gone);
    return chip;
  }
}
