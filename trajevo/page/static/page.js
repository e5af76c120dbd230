"use strict";
// The state that all parts of the page share, and the controls.

class State extends Clock {
  constructor(data, array) {
    super(data, array);
    Object.assign(this, {objectives: data.objectives, names: data.joints, file: array});
    this.rows = array(data.members.rows);
    this.F = array(data.members.F);
    this.G = array(data.members.G);
    this.count = this.rows.length;
    this.within = new Uint8Array(this.count).fill(1);
    this.kept = this.objectives.map(() => null);
    this.joints = new Set(this.names.keys());
    this.shares = data.quantities.some(({units}) => new Set(units).size > 1);
    Object.assign(this, {hovered: null, zoom: null});
    this.chosen = data.choices[0].member;
    const columns = this.objectives.map((_, k) => Array.from({length: this.count}, (__, row) => this.value(row, k)));
    this.ends = [columns.map((column) => Math.min(...column)), columns.map((column) => Math.max(...column))];
  }

  /** An objective of a member in the unit in which it is shown. */
  value(member, objective) {
    return this.F[member * this.objectives.length + objective] * this.objectives[objective].factor;
  }

  choose(member) {
    if (member === this.chosen) return;
    const share = this.time / this.duration;
    this.chosen = member;
    this.zoom = null;
    this.time = share * this.duration;
    this.tell("chosen");
    this.tell("time");
  }

  hover(member, event) {
    if (member !== this.hovered) {
      this.hovered = member;
      this.tell("hovered");
    }
    this.tip(member === null ? null : this.told(member), event);
  }

  tip(lines, event) {
    this.tell("tip", lines, event);
  }

  /** What stands out in every view: kinds of marks and members, the one on top last. */
  marked() {
    const hovered = this.hovered === null ? [] : [["hover", this.hovered]];
    return [...this.pins.map((pin) => ["pin", pin]), ...hovered, ["chosen", this.chosen]];
  }

  /** All members have one colour. */
  groupOf() {
    return 0;
  }

  told(member) {
    const rules = this.data.choices.filter((choice) => choice.member === member).map((choice) => choice.rule);
    return [
      [`row ${this.rows[member]}`, ...rules].join(", "),
      ...this.objectives.map(({name, unit}, k) => `${name} ${shown(this.value(member, k))} ${unit}`),
    ];
  }

  pin(member) {
    this.pins = this.pins.includes(member) ? this.pins.filter((pin) => pin !== member) : [...this.pins, member].slice(-4);
    this.tell("pins");
  }

  /** Keep a range of an objective, or all of it; what is outside fades. */
  keep(objective, range) {
    this.kept[objective] = range;
    for (let k = 0; k < this.count; k += 1) {
      const inside = this.kept.every(
        (each, axis) => !each || (this.value(k, axis) >= each[0] && this.value(k, axis) <= each[1]),
      );
      this.within[k] = inside ? 1 : 0;
    }
    this.tell("ranges");
  }

  zoomTo(range) {
    this.zoom = range;
    this.tell("zoom");
  }

  /** The member with the least weighted sum of the objectives, each from 0 at its least to 1 at its greatest value. */
  weighted(weights) {
    const total = weights.reduce((sum, weight) => sum + weight, 0);
    if (!(total > 0)) return this.chosen;
    const [low, high] = this.ends;
    let [best, found] = [Infinity, 0];
    for (let k = 0; k < this.count; k += 1) {
      let sum = 0;
      for (let axis = 0; axis < weights.length; axis += 1) {
        const span = high[axis] - low[axis];
        if (span > 0) sum += (weights[axis] / total) * ((this.value(k, axis) - low[axis]) / span);
      }
      if (sum < best) [best, found] = [sum, k];
    }
    return found;
  }
}

/** Views of the front behind tabs: pairs, space, parallel coordinates. */
function showFront(state) {
  const views = [...viewsOf(state), ["Parallel", [new ParallelView(state)], "single"]];
  showViews(state, views, () => state.objectives.forEach((_, k) => state.keep(k, null)));
  byId("front").addEventListener("keydown", (event) => {
    const step = {ArrowLeft: -1, ArrowRight: 1, ArrowUp: -1, ArrowDown: 1}[event.key];
    if (!step || event.target.matches("input")) return;
    event.preventDefault();
    stepTo(state, step);
  });
}

/** Go to the next solution, by ascending first objective, that is within the kept ranges. */
function stepTo(state, step) {
  let next = state.chosen + step;
  while (next >= 0 && next < state.count && !state.within[next]) next += step;
  if (next >= 0 && next < state.count) state.choose(next);
}

/** Buttons of the choices, sliders of weights, and the row by hand. */
function showChoices(state) {
  const host = byId("choices");
  const buttons = state.data.choices.map(({rule, member, reason}) =>
    made("button", {type: "button", text: rule.replaceAll("_", " "), title: reason, onclick: () => state.choose(member)}),
  );
  const back = made("button", {type: "button", text: "‹", "aria-label": "previous solution", onclick: () => stepTo(state, -1)});
  const next = made("button", {type: "button", text: "›", "aria-label": "next solution", onclick: () => stepTo(state, 1)});
  host.append(...buttons, back, next);
  state.on("chosen", () =>
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(state.data.choices[k].member === state.chosen))),
  );
  const sliders = state.objectives.map(({name}, k) => {
    const slider = made("input", {type: "range", min: 0, max: 100, value: 50, id: `weight-${k}`});
    slider.addEventListener("input", () => state.choose(state.weighted(sliders.map((each) => Number(each.value)))));
    host.nextElementSibling.append(made("label", {for: `weight-${k}`, text: name}), slider);
    return slider;
  });
  if (state.objectives.length < 2) host.nextElementSibling.hidden = true;
}

/** The chosen solution beside the pinned ones, its closest limits, and what is known of it. */
function showCard(state) {
  const draw = () => {
    const rows = [state.chosen, ...state.pins.filter((pin) => pin !== state.chosen)];
    const head = made("tr", {}, made("th", {text: ""}), ...rows.map((row, k) =>
      made("th", {}, made("span", {class: k ? "swatch second" : "swatch accent"}), `row ${state.rows[row]}`)));
    const values = state.objectives.map(({title}, k) =>
      made("tr", {}, made("th", {scope: "row", text: title}), ...rows.map((row, place) => {
        const value = state.value(row, k);
        const base = state.value(state.chosen, k);
        const change = place && base ? ` (${value >= base ? "+" : ""}${shown(100 * (value / base - 1), 3)} %)` : "";
        return made("td", {class: "number", text: shown(value, 6) + change});
      })));
    byId("values").replaceChildren(made("table", {}, made("thead", {}, head), made("tbody", {}, ...values)));
    const held = state.pins.includes(state.chosen);
    byId("pin").textContent = held ? "unpin" : "pin to compare";
    showLimits(state);
    showKnown(state);
    const row = state.rows[state.chosen];
    byId("said").textContent = `Solution ${state.told(state.chosen).join("; ")}`;
    const addressed = window.location.protocol !== "about:";
    if (addressed && window.location.hash !== `#row=${row}`) window.history.replaceState(null, "", `#row=${row}`);
  };
  byId("pin").addEventListener("click", () => state.pin(state.chosen));
  state.on("chosen", draw);
  state.on("pins", draw);
  draw();
}

/** The limits that the chosen solution comes nearest to. */
function showLimits(state) {
  const names = state.data.constraints;
  const used = names.map((name, k) => [name, 100 * (1 + state.G[state.chosen * names.length + k])]);
  used.sort((a, b) => b[1] - a[1]);
  const bars = used.slice(0, 6).map(([name, share]) => {
    const bar = made("span", {class: "bar"}, made("span", {class: "filled"}));
    bar.firstChild.style.width = `${Math.min(Math.max(share, 0), 100)}%`;
    return made("tr", {}, made("th", {scope: "row", text: name}), made("td", {}, bar), made("td", {class: "number", text: `${shown(share, 4)} %`}));
  });
  byId("limits").replaceChildren(made("table", {}, made("tbody", {}, ...bars)));
}

/** Certificate, payload and files of the chosen solution, or what makes them: the server, or a command. */
function showKnown(state) {
  const row = state.rows[state.chosen];
  const known = state.data.known[row] || {};
  const {run, option: [option, told]} = state.data;
  const command = (verb) => made("code", {text: `trajevo ${verb} ${run} --solution ${row}${option}`});
  const unknown = (verb, what) => (state.server ? state.server.unknown(what, row) : command(verb));
  const lines = [
    ["Certificate", known.certificate || unknown("certify", "certificate")],
    ...(state.data.carries ? [["Largest payload", known.payload || unknown("capacity", "payload")]] : []),
  ];
  const held = known.files || [];
  const files = held.map(({name, text, kind}) =>
    made("button", {type: "button", text: name, onclick: () => saved(name, new Blob([state.file(text)], {type: kind}))}));
  if (state.server) {
    const choice = state.data.choices.find(({member}) => member === state.chosen);
    files.push(...state.server.files(row, choice ? choice.rule : row, new Set(held.map(({name}) => name))));
  } else if (!files.length) files.push(command("export"), document.createTextNode(" --format csv"));
  const open = told && !state.server && (!known.certificate || !held.length);
  byId("known").replaceChildren(
    ...lines.map(([label, content]) => made("p", {}, made("b", {text: `${label}: `}), content)),
    made("p", {class: "files"}, made("b", {text: "Files: "}), ...files),
    ...(open ? [made("p", {class: "note", text: told})] : []),
  );
}

/** Offer a file for saving: exactly the bytes that Python wrote. */
function saved(name, content) {
  const link = made("a", {href: URL.createObjectURL(content), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Curves of all quantities, joints to show, and values or shares. */
function showProfiles(state) {
  const shapes = [...state.data.quantities];
  const effort = shapes.find(({name}) => name === "effort");
  if (effort) {
    const none = effort.low.map(() => null);
    shapes.push({name: "power", units: none.map(() => "W"), factors: none.map(() => 1), low: none, high: none});
  }
  state.profiles = shapes.map((quantity) => new Profile(state, quantity));
  byId("profiles").append(...state.profiles.map(({canvas}) => canvas));
  const joints = state.names.map((name, k) => {
    const button = made("button", {type: "button", class: "joint", "aria-pressed": "true", title: "show or hide this joint; with shift, it alone"}, made("span", {class: "line"}), name);
    button.addEventListener("click", (event) => {
      if (event.altKey || event.shiftKey) state.joints = new Set([k]);
      else if (!state.joints.delete(k)) state.joints.add(k);
      if (!state.joints.size) state.joints = new Set(state.names.keys());
      state.tell("joints");
    });
    return button;
  });
  const paint = () =>
    joints.forEach((button, k) => {
      button.setAttribute("aria-pressed", String(state.joints.has(k)));
      button.firstChild.style.background = seriesColour(k);
    });
  state.on("joints", paint);
  state.on("theme", paint);
  paint();
  const shares = made("button", {type: "button", text: "% of limits", "aria-pressed": String(state.shares)});
  shares.addEventListener("click", () => {
    state.shares = !state.shares;
    shares.setAttribute("aria-pressed", String(state.shares));
    state.tell("shares");
  });
  const whole = made("button", {type: "button", text: "whole motion", onclick: () => state.zoomTo(null)});
  state.on("zoom", () => (whole.hidden = !state.zoom));
  state.on("chosen", () => (whole.hidden = true));
  whole.hidden = true;
  byId("joints").append(...joints, shares, whole);
}

/** In a notebook's frame, tell what is chosen, and choose what Python asks for. */
function showFramed(state) {
  if (window.parent === window) return;
  state.on("chosen", () => window.parent.postMessage({trajevo: state.rows[state.chosen]}, "*"));
  window.addEventListener("message", ({source, data}) => {
    if (source !== window.parent || !data || !Number.isInteger(data.trajevo)) return;
    const member = state.rows.indexOf(data.trajevo);
    if (member >= 0) state.choose(member);
  });
}

/** The row that the address names, if the page has it. */
function fromAddress(state) {
  const asked = /^#row=(\d+)$/.exec(window.location.hash);
  const member = asked ? state.rows.indexOf(Number(asked[1])) : -1;
  if (member >= 0) state.choose(member);
}

async function begin() {
  const [data, array] = await opened();
  const state = new State(data, array);
  document.body.classList.add("live");
  if (isServed(state)) state.server = new Server(state);
  showTip(state);
  showFront(state);
  showChoices(state);
  showProfiles(state);
  showTransport(state);
  fromAddress(state);
  showCard(state);
  showTheme(state);
  showFramed(state);
  window.addEventListener("hashchange", () => fromAddress(state));
  state.tell("chosen");
  showLive(state);
  await showArm(state, array);
  window.trajevo = {state};
}

begin();
