// A drawing that is moved and zoomed: wheel, drag, two fingers, and the keys + - 0 and arrows.
import { button, svg } from "./dom.js";

const STEP = 1.25; // of a button or a key
const [SMALLEST, LARGEST] = [0.1, 4];
const READABLE = 0.62; // a new drawing is not made smaller than this to show all of it
const SLACK = 4; // px that a pointer may move in a click
const ZOOMS = { "+": STEP, "=": STEP, "-": 1 / STEP }; // by key
const MOVES = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };

/** Makes an empty stage: its element, its buttons, and functions that show a drawing and centre a point of it. */
export function newStage(label) {
  const scene = svg("g");
  const pointers = new Map();
  const release = ({ pointerId }) => pointers.delete(pointerId);
  const ends = { onpointerup: release, onpointercancel: release };
  const listeners = { onpointerdown, onpointermove, ...ends, onkeydown, onwheel };
  const node = svg("svg", { class: "stage", tabindex: 0, role: "group", "aria-label": label, ...listeners }, scene);
  let [x, y, zoom, width, height] = [0, 0, 1, 1, 1];
  let [dragged, touched] = [0, false]; // px of the last drag; whether someone has moved or zoomed this drawing

  function place(toX, toY, toZoom = zoom) {
    [x, y, zoom, touched] = [toX, toY, toZoom, true];
    scene.setAttribute("transform", `translate(${x} ${y}) scale(${zoom})`);
  }

  function fit(least = SMALLEST) {
    const all = Math.max(least, Math.min(node.clientWidth / width, node.clientHeight / height, 1.5));
    place(Math.max(0, (node.clientWidth - width * all) / 2), Math.max(0, (node.clientHeight - height * all) / 2), all);
    touched = least === SMALLEST;
  }

  function zoomBy(factor, [atX, atY] = [node.clientWidth / 2, node.clientHeight / 2]) {
    const to = Math.min(LARGEST, Math.max(SMALLEST, zoom * factor));
    place(atX + ((x - atX) * to) / zoom, atY + ((y - atY) * to) / zoom, to);
  }

  function at({ clientX, clientY }) {
    const { left, top } = node.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  function onwheel(event) {
    event.preventDefault();
    if (event.shiftKey) place(x - event.deltaY - event.deltaX, y);
    else zoomBy(STEP ** (-event.deltaY / 100), at(event));
  }

  function onpointerdown(event) {
    pointers.set(event.pointerId, at(event));
    dragged = 0;
  }

  function onpointermove(event) {
    const from = pointers.get(event.pointerId);
    if (!from) return;
    const to = at(event);
    const apart = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by);
    const [, other] = [...pointers].find(([id]) => id !== event.pointerId) ?? [];
    pointers.set(event.pointerId, to);
    dragged += apart(from, to);
    if (dragged > SLACK) node.setPointerCapture(event.pointerId); // not sooner: a click must reach its element
    if (other) zoomBy(apart(to, other) / (apart(from, other) || 1), other);
    else place(x + to[0] - from[0], y + to[1] - from[1]);
  }

  function onkeydown(event) {
    const { key } = event;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (key in MOVES) place(x + MOVES[key][0], y + MOVES[key][1]);
    else if (key in ZOOMS) zoomBy(ZOOMS[key]);
    else if (key === "0") fit();
    else return;
    event.preventDefault();
  }

  function show(nodes, ...size) {
    scene.replaceChildren(...nodes);
    [width, height] = size;
    fit(READABLE);
  }

  function centre(atX, atY) {
    const to = Math.max(zoom, READABLE);
    place(node.clientWidth / 2 - atX * to, node.clientHeight / 2 - atY * to, to);
  }

  function endDrag(event) {
    if (dragged > SLACK) event.preventDefault();
    if (dragged > SLACK) event.stopPropagation();
    dragged = 0;
  }

  node.addEventListener("click", endDrag, true);
  new ResizeObserver(() => touched || fit(READABLE)).observe(node);
  const buttons = [
    button("−", "Smaller (-)", () => zoomBy(1 / STEP)),
    button("+", "Larger (+)", () => zoomBy(STEP)),
    button("Fit", "Show all of it (0)", () => fit()),
  ];
  return { node, buttons, show, centre };
}
