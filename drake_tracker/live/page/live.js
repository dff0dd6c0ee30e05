// The page of a run: events come in, controls go out.

import { Overview } from "./overview.js";
import { Strips } from "./strips.js";
import { Windows } from "./windows.js";

const $ = (id) => document.getElementById(id);
const STAGES = {
  preparing: ["preparing", ""],
  windows: ["waiting for you", "asks"],
  running: ["running", "running"],
  writing: ["writing the results", "running"],
};
const LEGEND = [
  ["path", "predicted path"],
  ["energy", "moving pixels"],
  ["centroid", "their centroid"],
  ["window", "window of interest"],
];

const LEGEND_OF_SEVERAL = [
  ["path", "predicted path"],
  ["energy", "silhouettes"],
  ["centroid", "centroid of the target"],
  ["window", "window of interest"],
  ["target", "target"],
  ["other", "another object"],
  ["lost", "object not seen now"],
];

const MODES = {
  stop: ["arm stopped", "paused"],
  take_over: ["arm under your control", "asks"],
};
// Key, label, axis, sign and meaning of each step of the tool. The base of the arm looks along x.
const JOGS = [
  ["w", "x+", "x", 1, "away from the base"], ["s", "x\u2212", "x", -1, "towards the base"],
  ["a", "y+", "y", 1, "to the left of the base"], ["d", "y\u2212", "y", -1, "to the right of the base"],
  ["e", "z+", "z", 1, "up"], ["q", "z\u2212", "z", -1, "down"],
  [",", "\u21ba", "yaw", 1, "turn anticlockwise"], [".", "\u21bb", "yaw", -1, "turn clockwise"],
];

const strips = new Strips($("chart"));
const state = { facts: {}, time: 0, p_success: null, factor: null, paused: false, rate: null, operator: "supervise", tracks: [], reason: "" };
let overview = null;
let windows = null, views = [], fetching = false, newestFrame = 0, shownFrame = 0, drawing = false, over = false;

async function send(action, values = {}) {
  try {
    const reply = await fetch("/control", { method: "POST", body: JSON.stringify({ action, ...values }) });
    return reply.ok ? await reply.json() : { problem: await reply.text() };
  } catch {
    return { problem: "no answer from the run" };
  }
}

async function control(action, values) {
  const reply = await send(action, values);
  if (reply.problem) return reply.problem;
  take({ paused: reply.paused, rate: reply.rate, operator: reply.operator });
}

async function operate(action, values) {
  const problem = await control(action, values);
  $("operator-problem").textContent = problem ? `The run did not hear that: ${problem}` : "";
}

function take(news) {
  if (news.facts) takeFacts(news.facts);
  for (const key of ["time", "p_success", "factor", "paused", "rate", "operator", "tracks", "reason"]) if (key in news) state[key] = news[key];
  if (news.overview) overview?.take(news.overview);
  if (news.samples) strips.add(news.samples, news.afresh);
  if (news.frame) { newestFrame = news.frame; fetchFrame(); }
  if (!drawing) { drawing = true; requestAnimationFrame(draw); }
}

function takeFacts(facts) {
  const before = state.facts;
  state.facts = facts;
  if (facts.title) {
    $("title").textContent = facts.title;
    $("subtitle").textContent = facts.subtitle;
    document.title = `${facts.title} \u00b7 drake_tracker`;
  }
  if (facts.rates && !before.rates) makeRates(facts.rates);
  if (facts.strips && !before.strips) strips.describe(facts.phases, facts.strips, facts.span, facts.ribbon);
  if (facts.panels && !before.panels) makeViews(facts);
  if (facts.scene && !before.scene) makeScene(facts.scene);
  if (facts.scene === null) { // cameras of your own: there is no scene
    $("stack").hidden = true;
    $("main").classList.add("alone");
  }
  if (facts.clock) $("clock").textContent = facts.clock;
  if (facts.note) $("note").textContent = facts.note;
  $("pause").hidden = $("step").hidden = facts.controls === false;
  if (facts.overview && !before.overview) {
    overview = new Overview($("overview"), facts.overview);
    $("cameras").classList.add("with-overview");
  }
  if (facts.cameras === false) {
    $("cameras-empty").textContent = "This run has no cameras: the measured points are true positions with the measured error of the cameras.";
    $("cameras-empty").hidden = Boolean(facts.overview);
  }
  $("operator").hidden = !facts.operator || facts.stage === "over";
  const asks = facts.stage === "windows";
  $("windows").hidden = !asks;
  $("main").hidden = $("strips").hidden = asks;
  if (asks && !windows) windows = new Windows($("windows"), facts.image_size, facts.circles, send);
  if (facts.stage === "over" && !over) end(facts.outcome);
}

function draw() {
  drawing = false;
  const { stage, outcome } = state.facts;
  const held = stage === "running" && state.paused;
  const [words, kind] = outcome ? [outcome.title, outcome.success ? "good" : "bad"]
    : held ? ["paused", "paused"] : (stage === "running" && MODES[state.operator]) || STAGES[stage] || ["connecting", ""];
  $("stage").textContent = words;
  $("stage").className = `stage ${kind}`;
  $("time").textContent = state.time.toFixed(2);
  $("success").hidden = state.p_success === null;
  $("p-success").textContent = (100 * state.p_success).toFixed(0);
  $("factor").textContent = state.factor === null ? "\u2013" : state.factor.toFixed(2);
  const running = stage === "running";
  $("pause").disabled = $("step").disabled = !running;
  $("pause").textContent = held ? "Resume" : "Pause";
  for (const button of $("rates").children) {
    button.disabled = !running && stage !== "preparing";
    button.setAttribute("aria-pressed", String(JSON.parse(button.value) === state.rate));
  }
  const mode = state.operator;
  $("stop").disabled = !running || mode === "stop";
  $("take-over").disabled = !running || mode === "take_over";
  $("release").disabled = !running || mode === "supervise";
  for (const button of $("jogs").children) button.disabled = !running || mode !== "take_over";
  if (state.facts.several) drawTracks(running && state.facts.operator);
  overview?.draw();
  strips.now = state.time;
  strips.draw();
}

function drawTracks(selectable) {
  const rows = $("track-rows"), numbers = state.tracks.map(({ number }) => number).join();
  if (rows.dataset.numbers !== numbers) {
    rows.dataset.numbers = numbers;
    rows.replaceChildren(...state.tracks.map(makeTrack));
  }
  state.tracks.forEach((track, k) => {
    const [, states, speed, size, target] = rows.children[k].children;
    rows.children[k].className = `${track.target ? "target" : ""} ${track.seen ? "" : "lost"}`;
    rows.children[k].querySelector("button").disabled = !selectable;
    states.textContent = track.state;
    const pixels = state.facts.unit === "px";
    speed.textContent = pixels ? `${track.speed.toFixed(0)} px/s` : `${track.speed.toFixed(2)} m/s`;
    size.textContent = pixels ? `${track.size.toFixed(0)} px` : `${(1e3 * track.size).toFixed(0)} mm`;
    target.textContent = track.words || (track.target ? "target" : "");
  });
  const hint = selectable && state.tracks.length ? "Click on an object to make it the target." : "";
  $("reason").textContent = state.reason ? `No point: ${state.reason}. ${hint}` : hint;
  $("reason").classList.toggle("calm", !state.reason);
}

function makeTrack({ number, colour }) {
  const row = document.createElement("tr"), button = document.createElement("button");
  button.textContent = number;
  button.setAttribute("aria-label", `Make object ${number} the target`);
  button.onclick = () => operate("select", { number });
  row.style.setProperty("--track", colour);
  row.append(...Array.from({ length: 5 }, () => document.createElement("td")));
  row.firstChild.append(button);
  return row;
}

// Selects the track whose mark in a picture is nearest to the pixel that was clicked.
function selectAt(event, canvas, panel) {
  if (!state.facts.operator || state.facts.stage !== "running") return;
  const box = canvas.getBoundingClientRect();
  const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
  const x = (event.clientX - box.x - 0.5 * (box.width - scale * canvas.width)) / scale;
  const y = (event.clientY - box.y - 0.5 * (box.height - scale * canvas.height)) / scale;
  const distance = ({ at }) => at[panel] ? Math.hypot(at[panel][0] - x, at[panel][1] - y) : Infinity;
  const nearest = state.tracks.reduce((best, track) => (distance(track) < distance(best) ? track : best), { at: [] });
  if (nearest.number) operate("select", { number: nearest.number });
}

function makeRates(rates) {
  const all = [...rates.map((rate) => [rate, `${rate}\u00d7`]), [null, "as fast as possible"]];
  $("rates").replaceChildren(...all.map(([rate, words]) => {
    const button = document.createElement("button");
    button.value = JSON.stringify(rate);
    button.textContent = words;
    button.onclick = () => control("rate", { rate });
    return button;
  }));
}

function makeJogs() {
  $("jogs").replaceChildren(...JOGS.map(([key, label, axis, sign, meaning]) => {
    const button = document.createElement("button");
    button.textContent = label;
    button.title = `${key.toUpperCase()}: one step ${meaning}`;
    button.setAttribute("aria-label", meaning);
    button.onclick = () => operate("jog", { axis, sign });
    return button;
  }));
}

function makeScene(url) {
  const frame = document.createElement("iframe");
  frame.src = url;
  frame.title = "The laboratory in Meshcat: drag to rotate, scroll to zoom";
  $("scene").replaceChildren(frame);
}

function makeViews({ panels, goal, lag, several, legend, caption: words }) {
  $("cameras-empty").hidden = true;
  $("legend").hidden = false;
  $("legend").replaceChildren(...[...(legend || (several ? LEGEND_OF_SEVERAL : LEGEND)), ...(goal ? [["goal", goal]] : [])].map(([kind, words]) => {
    const item = document.createElement("li");
    item.className = kind;
    item.textContent = words;
    return item;
  }));
  $("tracks").hidden = !several;
  $("views").classList.toggle("several", several);
  const rows = panels.map((panel, index) => ({ ...panel, index })).sort((a, b) => a.late - b.late);
  views = rows.map(({ side, late, place, index }) => {
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const which = document.createElement("b");
    which.textContent = side ? side[0].toUpperCase() + side.slice(1) : "Camera";
    caption.append(which, words || (late ? `${several ? "silhouettes" : "detected motion"}, ${lag.toFixed(2)} s old` : "now, with the predicted path"));
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = place.slice(2);
    if (several) canvas.onclick = (event) => selectAt(event, canvas, index);
    figure.append(caption, canvas);
    $("views").append(figure);
    return { canvas, place };
  });
}

async function fetchFrame() {
  if (fetching || shownFrame === newestFrame) return;
  fetching = true;
  const number = newestFrame;
  try {
    const reply = await fetch("/frame.jpg");
    if (reply.ok) {
      const image = await createImageBitmap(await reply.blob());
      for (const { canvas, place: [x, y, width, height] } of views) {
        canvas.getContext("2d").drawImage(image, x, y, width, height, 0, 0, width, height);
      }
      image.close();
      $("cameras").dataset.frame = number;
      shownFrame = number;
    }
  } catch { /* the run may be over */ }
  fetching = false;
  if (shownFrame === number) fetchFrame();
}

function end(outcome) {
  over = true;
  $("scene").className += " over";
  events.close();
  const panel = $("outcome");
  panel.classList.toggle("good", outcome.success);
  $("outcome-title").textContent = outcome.title;
  $("outcome-reason").textContent = outcome.reason || "";
  $("outcome-rows").replaceChildren(...(outcome.rows || []).flatMap(([label, words]) => {
    const [term, value] = [document.createElement("dt"), document.createElement("dd")];
    [term.textContent, value.textContent] = [label, words];
    return [term, value];
  }));
  $("outcome-out").textContent = outcome.out || "";
  $("outcome-report").hidden = !outcome.report;
  if (outcome.report) $("outcome-report").href = outcome.report;
  panel.hidden = false;
}

$("pause").onclick = () => control(state.paused ? "resume" : "pause");
$("step").onclick = () => control("step");
$("stop").onclick = () => operate("operator", { mode: "stop" });
$("take-over").onclick = () => operate("operator", { mode: "take_over" });
$("release").onclick = () => operate("operator", { mode: "supervise" });
$("outcome-close").onclick = () => { $("outcome").hidden = true; };
document.addEventListener("keydown", (event) => {
  if (state.facts.stage !== "running" || event.ctrlKey || event.altKey || event.metaKey) return;
  const key = event.key.toLowerCase(), jog = JOGS.find(([its]) => its === key);
  const operator = state.facts.operator, button = event.target.closest?.("button");
  if (operator && key === "escape") operate("operator", { mode: "stop" });
  else if (operator && key === "t") operate("operator", { mode: "take_over" });
  else if (operator && key === "r") operate("operator", { mode: "supervise" });
  else if (operator && jog && state.operator === "take_over") operate("jog", { axis: jog[2], sign: jog[3] });
  else if (button) return;
  else if (event.code === "Space") control(state.paused ? "resume" : "pause");
  else if (event.code === "ArrowRight") control("step");
  else return;
  event.preventDefault();
});

// The scene is a page of its own. A click into it must not keep the keys, above all Escape, from this page.
window.addEventListener("blur", () => setTimeout(() => {
  if (document.activeElement?.tagName === "IFRAME") document.activeElement.blur();
}));

makeJogs();
const events = new EventSource("/events");
events.onopen = () => strips.add([], true);
events.onmessage = (event) => take(JSON.parse(event.data));
events.onerror = () => {
  if (over) return;
  $("stage").textContent = "no answer from the run";
  $("stage").className = "stage bad";
  for (const id of ["pause", "step", "stop", "take-over", "release"]) $(id).disabled = true;
  for (const button of $("jogs").children) button.disabled = true;
};
