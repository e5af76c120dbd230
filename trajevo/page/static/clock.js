"use strict";
// Time that all parts of a page share, and what is common to pages of runs, studies and animations.

/** What changes, and who wants to know it. */
class Told {
  constructor(data) {
    this.data = data;
    this.listeners = new Map();
  }

  on(event, call) {
    if (!this.listeners.has(event)) this.listeners.set(event, []);
    this.listeners.get(event).push(call);
  }

  tell(event, ...given) {
    for (const call of this.listeners.get(event) || []) call(...given);
  }
}

/** The motions of a page, the chosen one, and the instant at which all parts show it. */
class Clock extends Told {
  constructor(data, array) {
    super(data);
    this.motions = new Motions(data, array);
    Object.assign(this, {chosen: 0, pins: [], time: 0, playing: false});
  }

  get duration() {
    return this.motions.duration(this.chosen);
  }

  setTime(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.tell("time");
  }
}

const byId = (id) => document.getElementById(id);

/** Play, pause and scrub in real time. */
function showTransport(state) {
  const [play, scrub, clock] = ["play", "scrub", "clock"].map(byId);
  let before = 0;
  const run = (now) => {
    if (!state.playing) return;
    const next = state.time + (now - before) / 1000;
    before = now;
    state.setTime(next > state.duration ? 0 : next);
    requestAnimationFrame(run);
  };
  state.play = (playing) => {
    state.playing = playing;
    play.textContent = playing ? "pause" : "play";
    play.setAttribute("aria-pressed", String(playing));
    before = performance.now();
    if (playing) requestAnimationFrame(run);
  };
  play.addEventListener("click", () => state.play(!state.playing));
  scrub.addEventListener("input", () => {
    state.play(false);
    state.setTime((Number(scrub.value) / 1000) * state.duration);
  });
  state.on("time", () => {
    scrub.value = String(Math.round((1000 * state.time) / state.duration));
    clock.textContent = `${state.time.toFixed(3)} of ${state.duration.toFixed(3)} s`;
  });
  state.tell("time");
}

/** Light and dark: as the system says until the button is pressed. */
function showTheme(state) {
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => state.tell("theme"));
  byId("theme").addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    state.tell("theme");
  });
}

/** What the pointer is at, beside it. */
function showTip(state) {
  const tip = byId("tip");
  state.on("tip", (lines, event) => {
    tip.hidden = !lines;
    if (!lines || !event) return;
    tip.replaceChildren(...lines.map((line) => made("div", {text: line})));
    const left = Math.min(event.clientX + 14, window.innerWidth - tip.offsetWidth - 8);
    const top = Math.min(event.clientY + 14, window.innerHeight - tip.offsetHeight - 8);
    Object.assign(tip.style, {left: `${Math.max(left, 4)}px`, top: `${Math.max(top, 4)}px`});
  });
}

/** The robot in space, where the browser can draw it; else a sentence, and no room for it. */
async function showArm(state, array) {
  if (!state.data.arm || !byId("viewer")) return;
  const host = byId("arm");
  try {
    const viewer = new TextDecoder().decode(await unpacked("viewer"));
    document.head.append(made("script", {text: viewer}));
    state.arm = new ArmView(state, host, array);
    if (state.data.arm.why) host.after(made("p", {class: "note", text: state.data.arm.why}));
  } catch (error) {
    const why = drawsInSpace() ? error.message : "this browser, or this machine, has no WebGL";
    host.className = "without";
    host.replaceChildren(made("p", {class: "note", text: `The robot cannot be drawn here: ${why}.`}));
  }
}

function drawsInSpace() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
}

/** The page's data, and what finds its arrays. */
async function opened() {
  const buffer = await unpacked("arrays");
  return [JSON.parse(byId("data").textContent), (place) => arrayOf(buffer, place)];
}
