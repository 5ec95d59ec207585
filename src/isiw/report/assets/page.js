"use strict";
// Moves from trial to trial: the belief after the chosen one, and its sweep. All numbers come from the element #drawn.
(() => {
  const session = JSON.parse(document.getElementById("drawn").textContent);
  const trials = session.trials;
  const element = (id) => document.getElementById(id);
  const slider = element("trial");
  const ms = (value) => `${Math.round(value * 10) / 10} ms`;

  // ---- words

  function tellTrial(trial) {
    const realised = trial.realised === "–" ? "" : `, realised ${trial.realised}`;
    element("told-trial").textContent =
      `Trial ${trial.number} (${position + 1} of ${trials.length}): commanded ${trial.asked}${realised}, ${trial.outcome}.`;
  }

  function tellBelief(belief) {
    if (!belief) {
      element("told-belief").textContent = "The log holds no estimate after this trial.";
      return;
    }
    element("told-belief").textContent = `Estimate after it: ${[belief.found, ...belief.against, belief.reason].join(" ")}`;
  }

  const reasons = {
    initial: ", one of the ISIs that every session begins with.", plan: ", by the strategy's own plan.",
    acquisition: ", where the score is highest.", again: " again, as its trial was lost.", fallback: ", by a fallback.",
  };
  const why = (belief) => reasons[belief.chosenBy] ?? ".";

  function tellNext(belief) {
    const next = trials[position + 1];
    const fallback = next && session.fallbacks[next.number];
    const told = element("told-next");
    if (!belief) told.textContent = "";
    else if (belief.stop && !next) told.textContent = "No ISI came next: the session stopped.";
    else if (belief.nextMs !== null) told.textContent = `Next ISI: ${ms(belief.nextMs)}${fallback ? `, by a fallback: ${fallback}` : why(belief)}`;
    else told.textContent = next ? `Next came trial ${next.number}: ${next.asked}.` : "No ISI was chosen next.";
  }

  // ---- one chosen trial for all of it

  let position = 0;
  function choose(to) {
    position = Math.min(Math.max(to, 0), trials.length - 1);
    const trial = trials[position];
    const belief = session.beliefs[trial.number];
    slider.value = String(position);
    slider.setAttribute("aria-valuetext", `trial ${trial.number}`);
    element("sweep-title").textContent = `The sweep of trial ${trial.number}`;
    for (const button of document.querySelectorAll(".choose")) {
      button.setAttribute("aria-pressed", String(Number(button.dataset.trial) === trial.number));
    }
    tellTrial(trial);
    tellBelief(belief);
    tellNext(belief);
    draw.belief("belief", session, belief, trial.number);
    draw.sweep("sweep", session, trial, "The log has no waveforms of this trial.");
  }
  const chooseNumber = (number) => choose(trials.findIndex((trial) => trial.number === number));

  if (!trials.length) return;
  for (const part of document.querySelectorAll("[data-script]")) part.hidden = false;
  slider.max = String(trials.length - 1);
  slider.addEventListener("input", () => choose(Number(slider.value)));
  element("before").addEventListener("click", () => choose(position - 1));
  element("after").addEventListener("click", () => choose(position + 1));
  for (const button of document.querySelectorAll(".choose")) {
    button.addEventListener("click", () => {
      chooseNumber(Number(button.dataset.trial));
      element("explore").scrollIntoView();
    });
  }
  choose(trials.length - 1);
  element("belief").on("plotly_click", (event) => {
    const { customdata } = event.points[0];
    if (customdata !== undefined) chooseNumber(customdata);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => choose(position));
})();
