// The bar of a recording: play, scrub by time and by scan, jump to errors, operations and the first difference.
import { button, el, renew, write } from "./dom.js";
import { app } from "./app.js";
import { say } from "./operate.js";

const RATES = [0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10];
const STEPS = 1_000_000; // of the slider
const SETTLED_MS = 150; // at rest this long, the number of the scan is asked for
const MOST_MARKS = 400; // on the slider

const parts = {};
let settling = 0;
let wished = null; // the last position that was wished for while another was on its way
let isSeeking = false;

const span = () => app.hello.span;
const share = (t) => (t - span().from_ns) / Math.max(1, span().to_ns - span().from_ns);
const now = () => app.at?.t ?? span().to_ns;
const plays = () => Boolean(app.at?.rate);
const events = () => app.log.filter(({ kind }) => kind !== "note");
const isRecording = () => app.hello?.kind === "recording";
const isTyping = () => document.activeElement === parts.scan; // the number of a scan is not replaced then

/** Goes to a time, `{t}`, or to a task's scan, `{task, scan}`; of several wishes at once the last one counts. */
export async function seek(position) {
  wished = position;
  if (isSeeking) return;
  isSeeking = true;
  while (wished) {
    const wanted = wished;
    wished = null;
    await app.request("seek", wanted).catch(({ message }) => say(message));
  }
  isSeeking = false;
}

export function createPlayer() {
  const { slider, rate, task, scan } = Object.assign(parts, {
    slider: el("input", { type: "range", max: STEPS, step: STEPS / 1000, "aria-label": "Time", oninput: scrub }),
    marks: el("div", { class: "marks" }),
    time: el("span", { class: "time" }),
    rate: el("select", { "aria-label": "Rate", onchange: () => plays() && play(rate.value) }),
    task: el("select", { "aria-label": "Task whose scans are stepped", onchange: locate }),
    scan: el("input", { type: "number", min: 0, "aria-label": "Scan", title: "Scan of the task: Enter goes there" }),
    play: button("▶", "Play, pause (space)", () => play(plays() ? 0 : rate.value)),
    difference: button("", "", showDifference),
  });
  rate.append(...RATES.map((each) => el("option", { value: each, selected: each === 1 }, `${each} ×`)));
  scan.addEventListener("blur", locate);
  scan.addEventListener("change", () => scan.value && seek({ task: task.value, scan: Number(scan.value) }));
  const before = button("|◀", "Previous error or operation", () => jump(-1));
  const after = button("▶|", "Next error or operation", () => jump(1));
  const back = button("−", "One scan back (,)", () => step(-1));
  const on = button("+", "One scan on (.)", () => step(1));
  document.addEventListener("keydown", keyed);
  app.on("hello", greet);
  app.on("at", locate);
  const moves = el("div", { class: "group" }, before, parts.play, after, rate);
  const line = el("div", { class: "scrub" }, parts.marks, slider);
  const scans = el("div", { class: "group" }, task, back, scan, on);
  return el("div", { class: "player" }, moves, line, parts.time, scans, parts.difference);
}

function greet() {
  if (!isRecording()) return;
  parts.task.replaceChildren(...app.hello.tasks.map(({ name }) => el("option", {}, name)));
  const { first, label } = app.hello.other ?? {};
  parts.difference.hidden = !app.hello.other;
  parts.difference.disabled = !first;
  const where = first ? `First difference: ${first.task}, scan ${first.scan}` : `No difference from ${label}`;
  write(parts.difference, where);
  parts.difference.title = first?.text ?? "";
  const kept = Number(new URLSearchParams(location.search).get("at"));
  if (kept) seek({ t: kept });
}

function keyed(event) {
  const act = { " ": () => parts.play.click(), ",": () => step(-1), ".": () => step(1) }[event.key];
  const others = event.key === " " ? ", button, a, summary, [role=button], [tabindex='0']" : "";
  const isOthers = event.target.closest(`input, select, dialog${others}`);
  if (!act || isOthers || !isRecording()) return;
  act();
  event.preventDefault();
}

function scrub() {
  seek({ t: Math.round(span().from_ns + (parts.slider.valueAsNumber / STEPS) * (span().to_ns - span().from_ns)) });
}

function play(rate) {
  app.request("play", { rate: Number(rate) }).catch(({ message }) => say(message));
}

function jump(direction) {
  const times = events().map(({ t }) => t);
  const to = direction > 0 ? times.find((t) => t > now()) : times.findLast((t) => t < now());
  if (to === undefined) say(direction > 0 ? "No later error or operation" : "No earlier error or operation", "good");
  else seek({ t: to });
}

const scanNow = async () => (await app.request("scan", { task: parts.task.value, t: now() })).scan;

async function step(by) {
  const scan = await scanNow().catch(({ message }) => say(message));
  if (scan !== undefined) seek({ task: parts.task.value, scan: Math.max(0, scan + by) });
}

/** Shows the number of the scan once the position rests: the program executes the scan to answer. */
function locate() {
  clearTimeout(settling);
  if (!plays()) settling = setTimeout(settle, SETTLED_MS);
}

// The address keeps the position, in ns, for a reload and for somebody else with this recording.
async function settle() {
  history.replaceState(null, "", `?at=${now()}${location.hash}`);
  const number = await scanNow().catch(() => "");
  if (!isTyping()) parts.scan.value = number;
}

async function showDifference() {
  const { task, scan } = app.hello.other.first;
  parts.task.value = task;
  await seek({ task, scan });
  app.go("diagram", { task });
}

export function updatePlayer() {
  if (!isRecording()) return;
  if (plays() && !isTyping()) parts.scan.value = "";
  write(parts.play, plays() ? "❚❚" : "▶");
  if (!parts.slider.matches(":active")) parts.slider.value = Math.round(share(now()) * STEPS);
  parts.slider.ariaValueText = app.clock(now());
  write(parts.time, `${app.clock(now(), 4)} of ${app.clock(span().to_ns, 1)}`);
  renew(parts.marks, app.log.length, () => events().slice(-MOST_MARKS).map(mark));
}

function mark({ t, kind, ok }) {
  const node = el("i", { class: kind === "error" || ok === false ? "bad" : "" });
  node.style.left = `${100 * share(t)}%`;
  return node;
}
