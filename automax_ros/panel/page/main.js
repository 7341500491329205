// The frame of the page: header, tabs, the view that the address names, and one update for each frame of the screen.
import { chip, el, write } from "./dom.js";
import { app, connect } from "./app.js";
import { createPlayer, updatePlayer } from "./player.js";
import "./operate.js";
import { view as rack } from "./rack.js";
import { view as diagram } from "./diagram.js";
import { view as memory } from "./memory.js";
import { view as trends } from "./trends.js";
import { view as drive } from "./drive.js";
import { view as tasks } from "./tasks.js";
import { view as log } from "./log.js";

const KINDS = { rack: "rack of this program", joined: "joined rack", recording: "recording" };
const QUIET_MS = 3000; // a rack that runs sends its time more often
const NEW_ADDRESS_AFTER = 3; // failed attempts

const views = new Map([rack, diagram, memory, trends, drive, tasks, log].map((view) => [view.name, view]));
const roots = new Map(); // name of a view: its element
const tabs = new Map([...views].map(([name, { title }]) => [name, el("a", { href: `#${name}` }, title)]));
const at = (id) => document.getElementById(id);
const head = {
  rack: el("strong"),
  kind: chip("muted"),
  title: el("span", { class: "title" }),
  time: el("span", { class: "time", title: "Rack time" }),
  state: el("span", { "aria-live": "polite" }),
  forced: el("a", { href: "#memory?forced=1" }),
  operate: chip("muted"),
};
let shown = null;
let isDue = false; // an update at the next frame of the screen

function route() {
  const [name, text = ""] = location.hash.slice(1).split("?");
  const view = views.get(name) ?? rack;
  if (shown !== view) {
    shown?.hide();
    if (!roots.has(view.name)) roots.set(view.name, view.create());
    at("main").replaceChildren(roots.get(view.name));
    shown = view;
  }
  for (const [each, tab] of tabs) tab.ariaCurrent = each === view.name ? "page" : "false";
  tabs.get(view.name).scrollIntoView({ block: "nearest", inline: "nearest" });
  view.show(Object.fromEntries(new URLSearchParams(text)));
  ask();
}

function ask() {
  if (!isDue) requestAnimationFrame(update);
  isDue = true;
}

function update() {
  isDue = false;
  const start = performance.now();
  if (app.hello) {
    updateHead();
    shown.update();
    updatePlayer();
  }
  performance.clearMeasures("update");
  performance.measure("update", { start }); // how long the page took for the last news
}

/** The state of the rack in a word, and its colour. */
function stateOf({ over, powered, stopped, halted }) {
  if (over) return [over, "bad"];
  if (powered === false) return ["power off", "bad"];
  if (stopped) return ["STOPPED", "bad"];
  if (halted) return ["halted", "warn"];
  if (app.hello.kind === "recording") return ["ran", "good"];
  const quiet = performance.now() - app.heard;
  return quiet > QUIET_MS ? [`no news for ${Math.round(quiet / 1000)} s`, "warn"] : ["runs", "good"];
}

function updateHead() {
  const { rack: name, kind, operate } = app.hello;
  const title = app.hello.title === name ? "" : app.hello.title;
  const [state, colour] = app.connected ? stateOf(app.status) : ["connection lost", "bad"];
  const count = app.status.forced?.length ?? 0;
  const forced = count ? `${count} forced` : "";
  const texts = { rack: name, kind: KINDS[kind], title, time: app.clock(app.t), state, forced };
  for (const [key, text] of Object.entries(texts)) write(head[key], text);
  head.state.className = `chip ${colour}`;
  head.forced.className = count ? "chip forced" : "";
  write(head.operate, operate.allowed ? "may operate" : "look only");
  head.operate.title = operate.allowed ? "Each operation is shown first, then confirmed" : operate.why;
  document.title = `${state === "runs" ? "" : `${state}: `}${name} – AutoMax`;
}

app.on("connection", ({ attempt, wait }) => {
  document.body.classList.toggle("lost", !app.connected);
  const cure = attempt > NEW_ADDRESS_AFTER ? " If the program was started again, open the address that it prints." : "";
  const old = app.t === undefined ? "" : ` Values are those of ${app.clock(app.t)}.`;
  at("alarm").textContent = attempt ? `No connection.${old} Next attempt in ${wait / 1000} s.${cure}` : "";
  ask();
});
for (const event of ["frame", "status", "log", "at"]) app.on(event, ask);
app.on("hello", () => (at("player").hidden = app.hello.kind !== "recording"));
app.on("hello", route);
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target.matches("input, select") || document.querySelector("dialog")) return;
  at("main").querySelector("input[type=search]")?.focus();
  event.preventDefault();
});
window.addEventListener("hashchange", route);
setInterval(ask, 1000);
at("header").append(el("div", { class: "facts" }, Object.values(head)));
at("header").append(el("nav", { "aria-label": "Views" }, ...tabs.values()));
at("player").append(createPlayer());
route();
connect();
