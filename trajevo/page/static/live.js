"use strict";
// A page that is served: it follows its run, and begins what its buttons say.

const EVERY = 1500;

/** Remember what is chosen by its objectives, as rows have other numbers in the next front. */
function remembered(state) {
  const of = (member) => state.objectives.map((_, k) => state.value(member, k));
  const rule = (state.data.choices.find(({member}) => member === state.chosen) || {}).rule;
  const held = {rule, chosen: of(state.chosen), pins: state.pins.map(of), time: state.time / state.duration};
  window.sessionStorage.setItem("trajevo", JSON.stringify(held));
}

/** Choose again what was chosen before the page was loaded again. */
function recalled(state) {
  const held = JSON.parse(window.sessionStorage.getItem("trajevo") || "null");
  window.sessionStorage.removeItem("trajevo");
  if (!held || held.chosen.length !== state.objectives.length) return;
  const same = state.data.choices.find(({rule}) => rule === held.rule);
  state.choose(same ? same.member : nearestTo(state, held.chosen));
  state.pins = [...new Set(held.pins.map((values) => nearestTo(state, values)))];
  state.tell("pins");
  state.setTime(held.time * state.duration);
}

function nearestTo(state, values) {
  const [low, high] = state.ends;
  let [best, found] = [Infinity, 0];
  for (let k = 0; k < state.count; k += 1) {
    const apart = values.reduce((sum, value, axis) => {
      const span = high[axis] - low[axis] || 1;
      return sum + ((state.value(k, axis) - value) / span) ** 2;
    }, 0);
    if (apart < best) [best, found] = [apart, k];
  }
  return found;
}

/** What a served page asks its server about a solution of which it knows nothing yet. */
class Server {
  constructor(state) {
    this.state = state;
  }

  async ask(what, row, more = "") {
    const answer = await fetch(`${what}?row=${row}&stamp=${this.state.data.live.stamp}${more}`);
    if (!answer.ok) throw new Error(await answer.text());
    return answer;
  }

  /** A button that computes something, and stands aside for a sentence where that cannot be done. */
  button(text, title, call) {
    const button = made("button", {type: "button", text, title});
    button.addEventListener("click", async () => {
      button.disabled = true;
      try {
        await call();
      } catch (error) {
        button.after(made("span", {class: "alert", text: ` ${error.message}`}));
      }
      button.disabled = false;
    });
    return button;
  }

  /** A button for a certificate or a payload, which is shown in its place. */
  unknown(what, row) {
    return this.button(`compute the ${what}`, "", async () => {
      const text = await (await this.ask(what, row)).text();
      this.state.data.known[row] = {...this.state.data.known[row], [what]: text};
      if (this.state.rows[this.state.chosen] === row) showKnown(this.state);
    });
  }

  /** Buttons for files in all formats but some that the page has. */
  files(row, name, but) {
    const left = this.state.data.live.formats.filter(({ending}) => !but.has(`${name}.${ending}`));
    return left.map(({name: format, ending, told}) =>
      this.button(`${name}.${ending}`, told, async () => {
        const answer = await this.ask("file", row, `&format=${encodeURIComponent(format)}`);
        saved(`${name}.${ending}`, await answer.blob());
      }),
    );
  }
}

/** Whether a page is served, and not a copy of one on a disk. */
function isServed(state) {
  return Boolean(state.data.live) && window.location.protocol.startsWith("http");
}

/** Buttons that go on with the run, and a line of how it stands. */
function showLive(state) {
  const {live} = state.data;
  if (!isServed(state)) return;
  recalled(state);
  const said = made("span", {role: "status", id: "standing"});
  const begin = async (name, given = {}) => {
    const answer = await fetch(name, {
      method: "POST",
      headers: {"Content-Type": "application/json"},
      body: JSON.stringify(given),
    });
    if (!answer.ok) said.textContent = await answer.text();
    else tell(await answer.json());
  };
  const weights = () => state.objectives.map((_, k) => Number(byId(`weight-${k}`).value) / 100);
  const buttons = [
    ["polish from here", () => begin("polish")],
    [`${live.more} more generations`, () => begin("more")],
    ["solve again with these weights", () => begin("weigh", {weights: weights()})],
  ].map(([text, onclick]) => made("button", {type: "button", text, onclick}));
  if (state.objectives.length < 2) buttons.pop();
  byId("choices").after(made("div", {class: "row live"}, ...buttons, said));
  const tell = (now) => {
    const working = Boolean(now.job && now.job.running) || now.going;
    for (const button of buttons) button.disabled = working;
    const counted = now.going ? `generation ${now.generation} of ${now.generations}` : "";
    const job = now.job ? `${now.job.name} ${now.job.running ? "is running" : now.job.failed ? `failed: ${now.job.said}` : "is done"}` : "";
    said.textContent = [counted, job].filter(Boolean).join("; ");
    if (now.stamp !== live.stamp && !(now.job && now.job.running)) {
      remembered(state);
      window.location.reload();
    }
  };
  const follow = async () => {
    try {
      tell(await (await fetch("standing")).json());
    } catch {
      said.textContent = "the run is no longer served";
    }
    setTimeout(follow, EVERY);
  };
  follow();
}
