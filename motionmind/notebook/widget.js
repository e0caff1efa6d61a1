/** A widget of anywidget: the player's page in a frame, which shares the time and the selection with the model. */

const SHARED = ["time", "selection"];

function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.title = "Movement";
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  Object.assign(frame.style, { width: "100%", height: `${model.get("height")}px`, border: "0" });
  const show = () => (frame.srcdoc = model.get("_page"));

  const known = {}; // what the page has been told, or has said
  const tell = (name) => {
    known[name] = JSON.stringify(model.get(name));
    frame.contentWindow?.postMessage({ [name]: model.get(name) }, "*");
  };
  const hear = ({ source, data }) => {
    if (source !== frame.contentWindow) return;
    if (data.ready) return SHARED.forEach(tell);
    for (const name of SHARED.filter((name) => name in data)) {
      known[name] = JSON.stringify(data[name]);
      model.set(name, data[name]);
    }
    model.save_changes();
  };
  const listeners = Object.fromEntries(
    SHARED.map((name) => [`change:${name}`, () => JSON.stringify(model.get(name)) !== known[name] && tell(name)]),
  );
  listeners["change:_page"] = show;

  window.addEventListener("message", hear);
  for (const [event, listener] of Object.entries(listeners)) model.on(event, listener);
  show();
  el.append(frame);
  return () => {
    window.removeEventListener("message", hear);
    for (const [event, listener] of Object.entries(listeners)) model.off(event, listener);
  };
}

export default { render };
