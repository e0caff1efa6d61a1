/** An anywidget: the player's page in a frame that shares time and selection with the model. */

const SHARED = ["time", "selection"];

function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.title = "Movement";
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  Object.assign(frame.style, { width: "100%", height: `${model.get("height")}px`, border: "0" });
  const show = () => (frame.srcdoc = model.get("_page"));

  const known = {}; // the values last sent to the page, or received from it
  const send = (name) => {
    known[name] = JSON.stringify(model.get(name));
    frame.contentWindow?.postMessage({ [name]: model.get(name) }, "*");
  };
  const receive = ({ source, data }) => {
    if (source !== frame.contentWindow) return;
    if (data.ready) return SHARED.forEach(send);
    for (const name of SHARED.filter((name) => name in data)) {
      known[name] = JSON.stringify(data[name]);
      model.set(name, data[name]);
    }
    model.save_changes();
  };
  const listeners = Object.fromEntries(
    SHARED.map((name) => [`change:${name}`, () => JSON.stringify(model.get(name)) !== known[name] && send(name)]),
  );
  listeners["change:_page"] = show;

  window.addEventListener("message", receive);
  for (const [event, listener] of Object.entries(listeners)) model.on(event, listener);
  show();
  el.append(frame);
  return () => {
    window.removeEventListener("message", receive);
    for (const [event, listener] of Object.entries(listeners)) model.off(event, listener);
  };
}

export default { render };
