// The drives: the power circuit of each with line, bridge, SCRs that conduct, motor and faults; the webs that come to it
// and leave it; and what breaks them.
import { button, el, renew, svg, write } from "./dom.js";
import { app } from "./app.js";

// The pairs of SCRs on each terminal, on the upper and on the lower rail: that of bridge 1, its partner of bridge 2.
const LEGS = { T1: [[1, 14], [4, 11]], T2: [[3, 16], [6, 13]], T3: [[5, 12], [2, 15]] };
const READINGS = { speed_rpm: "Speed, rpm", armature_a: "Current, A", armature_v: "Voltage, V" };
Object.assign(READINGS, { delta_deg: "DELTA, degrees", load_torque_nm: "Load, N m" });
const ROLL_READINGS = { diameter_m: "Diameter, m", web_mps: "Web, m/s" }; // of a plant with a roll or roller
const CURVES = ["speed_rpm", "current_a"]; // signals that the link to the trends shows
const [UPPER, LOWER, MOTOR_X, MOTOR_Y] = [40, 290, 680, 165]; // rails and motor in the drawing

const root = el("section", { class: "view-drive" });
let cards = new Map(); // by plant: its elements
let greeted = null; // the hello for which the cards are
let shown = false;

const isRecording = () => app.hello.kind === "recording";
const controlsOf = (plant) => app.hello.plants.find(({ name }) => name === plant)?.controls ?? [];
const websOf = (plant) => app.hello.webs.filter(({ from, to }) => [from, to].includes(plant));

function show() {
  shown = true;
  update();
}

function update() {
  if (!shown || !app.hello) return;
  if (greeted !== app.hello) [greeted, cards] = [app.hello, new Map()];
  const drives = app.status.drives ?? [];
  const none = drives.length ? "" : el("p", { class: "hint" }, "No drive: this rack has no plant, or none recorded.");
  if (!cards.size) root.replaceChildren(none);
  for (const drive of drives) {
    if (!cards.has(drive.plant)) cards.set(drive.plant, newCard(drive));
    paint(cards.get(drive.plant), drive);
  }
}

function newCard(drive) {
  const { plant, slot } = drive;
  const card = { marks: new Map(), buttons: new Map(), state: el("span"), faults: el("ul", { class: "drive-faults" }) };
  const [webs, shownValues] = [websOf(plant), { ...READINGS, ...(drive.roll && ROLL_READINGS) }];
  card.values = Object.keys(shownValues).map((key) => [key, el("b")]);
  const readings = card.values.map(([key, value]) => el("div", { class: "reading" }, shownValues[key], value));
  const names = [...CURVES.map((signal) => `${plant}/${signal}`), ...webs.map(({ name }) => `${name}/tension_n`)];
  const title = webs.length ? "Speed, current and tension as trends" : "Speed and current as trends";
  const curves = app.link(title, "trends", { names: names.join(";") });
  const side = el("div", { class: "drive-side" }, card.faults, el("div", { class: "readings" }, readings), curves);
  card.webs = webs.map(({ name }) => [name, el("b")]);
  const line = card.webs.length ? drawWebs(plant, webs, card.webs) : null;
  const head = el("div", { class: "drive-head" }, el("h2", {}, plant), drivePlace(drive), card.state);
  const body = el("div", { class: "drive-body" }, drawCircuit(card, drive), side);
  root.append(el("article", { class: "drive" }, head, line, body, isRecording() ? null : drawControls(card, drive)));
  return card;
}

// The slot of the drive's module, and which drive of a UDC it is: "slot 10, drive A"; nothing where no drive turns it.
function drivePlace({ plant, slot }) {
  if (slot === null) return "";
  const which = app.hello.plants.find(({ name }) => name === plant)?.drive;
  return `slot ${slot}${which ? `, drive ${which}` : ""}`;
}

// The plant between the webs that come and go: A — W1 432 N → PLANT — W2 510 N → B.
function drawWebs(plant, webs, nodes) {
  const drawn = webs.map(({ from, to }, k) => {
    const [name, tension] = nodes[k];
    const way = el("span", { class: "web" }, `${name} `, tension, " →");
    return { comes: to === plant, parts: to === plant ? [from, way] : [way, to] };
  });
  const parts = (comes) => drawn.filter((each) => each.comes === comes).map((each) => each.parts);
  const label = { role: "group", "aria-label": `Webs of ${plant}` };
  return el("div", { class: "drive-webs", ...label }, parts(true), el("strong", {}, plant), parts(false));
}

function drawCircuit({ marks }, { plant, contactors }) {
  const [wires, paths, symbols] = [[], [], []];
  const put = (list, key, node) => (marks.set(key, node), list.push(node));
  const wire = (...points) => wires.push(svg("polyline", { class: "power", points: points.join(" ") }));
  const hasReverse = controlsOf(plant).find(({ control }) => control === "short_scr")?.values.includes("11") ?? true;
  Object.entries(LEGS).forEach(([terminal, pairs], leg) => {
    const [x, y] = [170 + 125 * leg, 130 + 35 * leg];
    wire(36, y, x, y);
    wire(x, UPPER, x, LOWER);
    wires.push(svg("circle", { class: "node", cx: x, cy: y, r: 4 }));
    const fuse = svg("rect", { class: "fuse", x: 70, y: y - 6, width: 34, height: 12 });
    put(symbols, terminal, svg("g", { class: "terminal" }, fuse, svg("text", { x: 14, y: y + 4 }, terminal)));
    pairs.forEach((pair, isLower) => {
      const [rail, middle, way] = isLower ? [LOWER, 262, 22] : [UPPER, 78, -22];
      const loop = [x, middle - way, x + 46, middle - way, x + 46, middle + way, x, middle + way];
      if (hasReverse) wire(...loop);
      pair.slice(0, hasReverse ? 2 : 1).forEach((number, isReverse) => {
        const points = [36, y, x, y, ...(isReverse ? loop : []), x, rail, MOTOR_X, rail, MOTOR_X, MOTOR_Y].join(" ");
        put(paths, `path ${number}`, svg("polyline", { class: "path", points }));
        put(symbols, `scr ${number}`, drawScr(plant, number, x + 46 * isReverse, middle, isReverse));
      });
    });
  });
  for (const rail of [UPPER, LOWER]) wire(170, rail, MOTOR_X, rail, MOTOR_X, MOTOR_Y);
  contactors.forEach(({ name }, k) => {
    const x = 560 - 60 * k;
    const gap = svg("rect", { class: "gap", x, y: UPPER - 8, width: 26, height: 16 });
    const blade = svg("line", { class: "blade", x1: x, y1: UPPER, x2: x + 26, y2: UPPER });
    const label = svg("text", { x: x + 13, y: 22 }, name);
    put(symbols, `contactor ${name}`, svg("g", { class: "contactor" }, gap, blade, label));
  });
  wire(MOTOR_X, MOTOR_Y, MOTOR_X + 70, MOTOR_Y);
  for (const [key, x, r, text] of [["motor", MOTOR_X, 34, "M"], ["tach", MOTOR_X + 70, 14, "T"]]) {
    const shape = [svg("circle", { cx: x, cy: MOTOR_Y, r }), svg("text", { x, y: MOTOR_Y + r / 5 }, text)];
    put(symbols, key, svg("g", { class: key }, shape));
  }
  const coil = svg("path", { d: `M ${MOTOR_X - 62} ${MOTOR_Y - 28} ${"q 14 7 0 14 ".repeat(4)}` });
  put(symbols, "field", svg("g", { class: "field" }, coil, svg("text", { x: MOTOR_X - 60, y: MOTOR_Y + 46 }, "field")));
  const label = { role: "group", "aria-label": `Power circuit of ${plant}` };
  return svg("svg", { class: "circuit", viewBox: "0 0 780 320", ...label }, wires, paths, symbols);
}

// An SCR of bridge 1 points up, its partner of bridge 2 down.
function drawScr(plant, number, x, y, isReverse) {
  const flip = `scale(1 ${isReverse ? -1 : 1})`;
  const act = ({ shiftKey, key = "Enter" }) => {
    const control = shiftKey ? "open_gate" : "short_scr";
    if (key === "Enter") app.operate("plant", { name: plant, control, value: String(number) });
  };
  const isStill = isRecording() || !app.hello.operate.allowed;
  const acts = isStill ? {} : { tabindex: 0, role: "button", onclick: act, onkeydown: act };
  return svg(
    "g",
    { class: "scr", transform: `translate(${x} ${y}) ${flip}`, ...acts },
    svg("title", {}, `SCR ${number}${isStill ? "" : ": a click shorts it, Shift and click opens its gate"}`),
    svg("rect", { class: "reach", x: isReverse ? -14 : -32, y: -20, width: 48, height: 40 }),
    svg("path", { class: "body", d: "M -11 9 L 11 9 L 0 -9 Z" }),
    svg("path", { class: "bar", d: "M -11 -9 H 11" }),
    svg("path", { class: "gate", d: "M 4 -9 L 14 -17" }),
    svg("text", { x: isReverse ? 15 : -30, y: 5, transform: flip }, number),
  );
}

function drawControls({ buttons }, { plant, slot }) {
  const { operate, switches } = app.hello;
  const newControl = (verb, name, { control, values, text = `of the module in slot ${name}` }) => {
    const disabled = !operate.allowed;
    const words = `${verb === "web" ? `${name} ` : ""}${control.replaceAll("_", " ")}`;
    const title = text ? `${words}: ${text}` : `${control} web ${name}`;
    const act = (value) => app.operate(verb, { name, control, value });
    const newButton = (label, read) => button(label, title, () => act(read()), { disabled });
    const onkeydown = ({ key }) => key === "Enter" && act(input.value);
    const input = el("input", { "aria-label": title, title, placeholder: text, disabled, onkeydown });
    const all = values.map((value) => newButton(value || words, () => value));
    if (verb !== "web") values.forEach((value, k) => buttons.set(`${control} ${value}`, all[k]));
    const inside = all.length ? all : [input, newButton("Set", () => input.value)];
    const label = values.includes("") ? null : el("span", { title }, words); // the button has the same words
    return el("div", { class: `control ${control}` }, label, inside);
  };
  const isOnly = app.status.drives.length === 1;
  const levers = switches.filter((lever) => isOnly || lever.slot === slot);
  const all = [
    ...levers.map((lever) => newControl("module", String(lever.slot), lever)),
    ...controlsOf(plant).map((control) => newControl("plant", plant, control)),
    ...websOf(plant).flatMap(({ name, controls }) => controls.map((control) => newControl("web", name, control))),
  ];
  const why = operate.allowed ? null : el("p", { class: "hint" }, `Nothing can be operated here: ${operate.why}.`);
  return [why, el("div", { class: "drive-controls" }, all)];
}

function paint({ marks, buttons, state, faults, values, webs }, drive) {
  const told = { ...drive, ...drive.roll };
  const digits = (key) => (key in ROLL_READINGS ? 3 : 1);
  for (const [key, node] of values) write(node, Number.isFinite(told[key]) ? told[key].toFixed(digits(key)) : "–");
  for (const [name, node] of webs) paintWeb(node, app.status.webs?.find((web) => web.name === name));
  write(state, [drive.state, drive.bridge && `bridge ${drive.bridge}`].filter(Boolean).join(", "));
  const broken = drive.broken.map((text) => el("li", { class: "broken" }, text.replaceAll("_", " ")));
  renew(faults, [drive.faults, drive.broken], () => [drive.faults.map((text) => el("li", {}, text)), broken]);
  const isBroken = (text) => drive.broken.some((each) => `${each} `.startsWith(`${text} `));
  const light = (key, states) => {
    for (const each in states) marks.get(key)?.classList.toggle(each, Boolean(states[each]));
  };
  for (const [terminal, pairs] of Object.entries(LEGS)) {
    light(terminal, { blown: isBroken(`blow_fuse ${terminal}`), lost: isBroken(`lose_phase ${terminal}`) });
    for (const [pair, number] of pairs.flatMap((each) => each.map((one) => [each, one]))) {
      const on = drive.conducting.includes(number);
      const shorted = pair.some((one) => isBroken(`short_scr ${one}`)); // a shorted SCR bypasses its partner
      const faulty = { shorted, open: isBroken(`open_gate ${number}`) };
      light(`scr ${number}`, { on, fired: drive.gates.includes(number), ...faulty });
      light(`path ${number}`, { on });
    }
  }
  for (const { name, on } of drive.contactors) light(`contactor ${name}`, { closed: on });
  light("motor", { on: Math.abs(drive.speed_rpm) > 1 });
  for (const part of ["field", "tach"]) light(part, { lost: isBroken(`lose_${part}`) });
  for (const [verb, node] of buttons) node.classList.toggle("active", isBroken(verb.replace(/ true$/, "")));
}

function paintWeb(node, web) {
  const hangs = web?.slack_m > 0 ? `slack by ${web.slack_m.toFixed(3)} m` : `${web?.tension_n?.toFixed(1) ?? "–"} N`;
  write(node, web?.broken ? "broken" : hangs);
  node.parentNode.classList.toggle("broken", Boolean(web?.broken));
}

const hide = () => (shown = false);
export const view = { name: "drive", title: "Drive", create: () => root, show, hide, update };
