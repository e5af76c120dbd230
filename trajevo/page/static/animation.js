"use strict";
// A page that shows one motion in space and nothing else.

async function begin() {
  const [data, array] = await opened();
  const state = new Clock(data, array);
  document.body.classList.add("live");
  showTransport(state);
  showTheme(state);
  await showArm(state, array);
  state.play(!window.matchMedia("(prefers-reduced-motion: reduce)").matches);
  window.trajevo = {state};
}

begin();
