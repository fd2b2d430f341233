// The page as a widget of a notebook (anywidget): an iframe, whose messages become the widget's values.

function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts");
  frame.title = "a scene";
  frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 0; border-radius: 8px; display: block;`;
  frame.srcdoc = model.get("page");
  let told = null;  // the camera that the page told last: no order
  const send = (word, said) => frame.contentWindow?.postMessage({ langflash: word, ...said }, "*");
  const hear = ({ source, data }) => {
    if (source !== frame.contentWindow || !data) return;
    const { langflash: word, ...said } = data;
    if (word === "camera") model.set("camera", (told = said));
    else if (word === "answers") model.set("answers", said.answers);
    else if (word === "stop") model.set("stop", said.name);
    else if (word === "ready") model.set("ready", true);
    else return;
    model.save_changes();
  };
  const wanted = {
    "change:camera": () => model.get("camera") !== told && send("go", { camera: model.get("camera") }),
    "change:asked": () => send("ask", { phrase: model.get("asked") }),
    "change:go": () => send("go", model.get("go")),
  };
  addEventListener("message", hear);
  Object.entries(wanted).forEach(([event, act]) => model.on(event, act));
  el.append(frame);
  return () => {
    removeEventListener("message", hear);
    Object.entries(wanted).forEach(([event, act]) => model.off(event, act));
  };
}

export default { render };
