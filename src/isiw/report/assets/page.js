"use strict";
// Draws what moves: the belief after the chosen trial, and that trial's sweep. All numbers come from the element #drawn.
(() => {
  const session = JSON.parse(document.getElementById("drawn").textContent);
  const trials = session.trials;
  const after = { impact: "after the impact", valve: "after the valve command" }[session.reference];
  const names = { counts: "trial", excluded: "excluded", mistrial: "mistrial" };
  const options = { displayModeBar: false, responsive: true }; // plotly's own buttons would upload what is drawn
  const element = (id) => document.getElementById(id);
  const slider = element("trial");

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const axis = (title, more = {}) => ({
    title: { text: title, font: { size: 13 } }, gridcolor: colour("line"), linecolor: colour("line"),
    zeroline: false, automargin: true, ...more,
  });
  const layout = (more) => ({
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("ink"), size: 12 },
    margin: { l: 60, r: 12, t: 12, b: 44 }, hovermode: "closest", ...more,
  });
  const ms = (value) => `${Math.round(value * 10) / 10} ms`;
  const markup = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");

  // ---- the belief after a trial

  const sizesUv = [...trials.map((trial) => trial.mepUv), ...Object.values(session.beliefs)
    .flatMap((belief) => [...belief.low, ...belief.high, ...belief.predictedLow, ...belief.predictedHigh])];
  const positiveUv = sizesUv.filter((size) => size !== null && size >= 1);
  const lowestUv = positiveUv.reduce((least, size) => Math.min(least, size), 10) * 0.8;
  const largestUv = positiveUv.reduce((most, size) => Math.max(most, size), 100) * 1.3;
  const ticksUv = [1, 10, 100, 1000, 10000].flatMap((ten) => [ten, 2 * ten, 5 * ten]);

  const line = (x, y, name, style, more = {}) => ({ x, y, name, mode: "lines", line: style, hoverinfo: "skip", ...more });

  function profileTraces(belief) {
    if (!belief || !belief.isiMs.length) return [];
    const none = { width: 0, color: colour("blue") };
    const band = (low, high, name, fillcolor) => (low.length ? [
      line(belief.isiMs, low, "", none, { showlegend: false }),
      line(belief.isiMs, high, name, none, { fill: "tonexty", fillcolor }),
    ] : []);
    return [
      ...band(belief.predictedLow, belief.predictedHigh, "prediction: 90 % of trials lie here", "rgba(130,135,140,0.2)"),
      ...band(belief.low, belief.high, "90 % band of the expected MEP", "rgba(60,150,220,0.3)"),
      line(belief.isiMs, belief.profile, "expected MEP", { width: 2, color: colour("blue") }),
    ];
  }

  // A mistrial is drawn where it happened: at the lower edge where no MEP was measured, at what was asked where nothing came.
  const placeMs = (trial) => (trial.kind === "mistrial" ? trial.isiMs ?? trial.askedMs : trial.isiMs);
  const measuredUv = (trial) => (trial.mepUv === null ? null : Math.max(trial.mepUv, lowestUv));
  const heightUv = (trial) => measuredUv(trial) ?? (trial.kind === "mistrial" ? lowestUv : null);

  function trialTrace(kind, number) {
    const symbol = { counts: "circle", excluded: "circle-open", mistrial: "x-thin-open" }[kind];
    const shown = trials.filter((trial) => trial.kind === kind && placeMs(trial) !== null && heightUv(trial) !== null);
    return {
      x: shown.map(placeMs), y: shown.map(heightUv), text: shown.map((trial) => trial.outcome),
      customdata: shown.map((trial) => trial.number), name: names[kind], mode: "markers", type: "scatter",
      marker: {
        symbol, size: shown.map((trial) => (trial.number === number ? 14 : 8)),
        color: colour(kind === "mistrial" ? "red" : "ink"),
        opacity: shown.map((trial) => (trial.number > number ? 0.18 : 1)),
        line: { width: kind === "mistrial" ? 2 : 1, color: colour(kind === "mistrial" ? "red" : "ink") },
      },
      hovertemplate: "trial %{customdata}<br>%{x:.1f} ms, %{text}<extra></extra>",
    };
  }

  // What the acquisition function said of every ISI, as a strip below the belief.
  const isScored = (belief) => Boolean(belief && belief.scores.length);
  function scoreTraces(belief) {
    if (!isScored(belief)) return [];
    return [line(belief.scoredMs, belief.scores, "score of the acquisition function", { width: 1.5, color: colour("ink") },
      { yaxis: "y2", hoverinfo: "x+y" })];
  }

  // The 90 % intervals of the edges that are known, each with its colour.
  const edgeHeights = { start: 1.02, end: 1 };
  const intervals = (belief) => [["start", "green", belief.start], ["end", "orange", belief.end]]
    .filter(([, , pair]) => belief.window.length && !pair.includes(null));

  function beliefShapes(belief) {
    if (!belief) return [];
    const edge = (value) => (value === "low" ? session.range[0] : value === "high" ? session.range[1] : value);
    const window = belief.window.map(([x0, x1]) => ({
      type: "rect", x0, x1, yref: "paper", y0: 0, y1: 1, fillcolor: colour("blue"), opacity: 0.12, line: { width: 0 },
    }));
    const bars = intervals(belief).map(([name, hue, [low, high]]) => ({
      type: "line", x0: edge(low), x1: edge(high), yref: "paper", y0: edgeHeights[name], y1: edgeHeights[name],
      line: { width: 6, color: colour(hue) },
    }));
    const next = belief.nextMs === null ? [] : [{
      type: "line", x0: belief.nextMs, x1: belief.nextMs, yref: "paper", y0: 0, y1: 1,
      line: { width: 1.5, dash: "dash", color: colour("ink") },
    }];
    return [...window, ...bars, ...next];
  }

  function drawBelief(number) {
    const belief = session.beliefs[number];
    const key = (name, style) => line([null], [null], name, style);
    const found = belief && belief.window.length ? [
      key("window", { width: 10, color: "rgba(60,150,220,0.3)" }),
      ...intervals(belief).map(([name, hue]) => key(`90 % interval of its ${name}`, { width: 6, color: colour(hue) })),
    ] : [];
    const next = belief && belief.nextMs !== null
      ? [key("asked next", { width: 1.5, dash: "dash", color: colour("ink") })] : [];
    const points = Object.keys(names).map((kind) => trialTrace(kind, number));
    const traces = [...profileTraces(belief), ...points, ...found, ...scoreTraces(belief), ...next];
    Plotly.react("belief", traces, layout({
      xaxis: axis(`ISI ${after} [ms]`, { range: session.range, anchor: isScored(belief) ? "y2" : "y" }),
      yaxis2: axis("score", { domain: [0, 0.2], visible: isScored(belief), showticklabels: false }),
      yaxis: axis("MEP [µV]", {
        domain: isScored(belief) ? [0.26, 1] : [0, 1], type: "log", tickvals: ticksUv, range: [Math.log10(lowestUv * 0.9), Math.log10(largestUv)],
      }),
      shapes: beliefShapes(belief), uirevision: "belief", margin: { l: 60, r: 12, t: 60, b: 44 },
      legend: { orientation: "h", y: 1.04, yanchor: "bottom", traceorder: "normal" },
    }), options);
  }

  // ---- the sweep of a trial

  const mark = (x, index, name) => ({
    type: "line", x0: x, x1: x, xref: `x${index || ""}`, yref: `y${index || ""} domain`, y0: 0, y1: 1,
    line: { width: 1.5, dash: name === "tms" ? "solid" : "dot", color: colour(name === "tms" ? "faint" : "orange") },
  });

  function sweepMarks(trial, index) {
    const at = { tms: trial.tmsMs, hit: trial.hitMs, valve: trial.valveMs };
    const lines = Object.entries(at).filter(([, x]) => x !== null).map(([name, x]) => mark(x, index, name));
    if (trial.tmsMs === null) return lines;
    const [low, high] = session.mepWindow.map((edge) => trial.tmsMs + edge);
    return [...lines, {
      type: "rect", x0: low, x1: high, xref: `x${index || ""}`, yref: `y${index || ""} domain`, y0: 0, y1: 1,
      fillcolor: colour("green"), opacity: 0.18, line: { width: 0 }, layer: "below",
    }];
  }

  function drawSweep(trial) {
    const waves = trial.sweep;
    const figure = element("sweep");
    if (!waves.length) {
      Plotly.purge(figure);
      figure.style.height = "auto";
      figure.textContent = "The log has no waveforms of this trial.";
      return;
    }
    if (!figure.classList.contains("js-plotly-plot")) figure.textContent = "";
    figure.style.height = `${60 + 120 * (waves.length + 1)}px`;
    const traces = [];
    const axes = {};
    const shapes = [];
    const share = 1 / (waves.length + 1); // the first, the EMG near the pulse, is twice as high
    waves.forEach((wave, k) => {
      const index = k ? k + 1 : "";
      const x = wave.values.map((_, n) => wave.t0 + n * wave.step);
      const [top, height] = k ? [1 - (k + 1) * share, share] : [1, 2 * share];
      traces.push({
        x, y: wave.values, xaxis: `x${index}`, yaxis: `y${index}`, mode: "lines", showlegend: false,
        line: { width: 1, color: colour("ink") }, hovertemplate: "%{x:.1f} ms: %{y:.3g}<extra></extra>",
      });
      axes[`xaxis${index}`] = axis(k === waves.length - 1 ? "time of the sweep [ms]" : "",
        { range: [x[0], x[x.length - 1]], anchor: `y${index}` });
      axes[`yaxis${index}`] = axis(`${markup(wave.name)}<br>[${markup(wave.unit)}]`,
        { domain: [top - height + 0.3 * share, top], anchor: `x${index}` });
      shapes.push(...sweepMarks(trial, index));
    });
    Plotly.react(figure, traces, layout({ ...axes, shapes, margin: { l: 90, r: 12, t: 8, b: 44 } }), options);
  }

  // ---- words

  function tellTrial(trial) {
    const realised = trial.realised === "–" ? "" : `, realised ${trial.realised}`;
    element("told-trial").textContent =
      `Trial ${trial.number} (${position + 1} of ${trials.length}): asked ${trial.asked}${realised}, ${trial.outcome}.`;
  }

  function tellBelief(belief) {
    if (!belief) {
      element("told-belief").textContent = "The log holds no estimate after this trial.";
      return;
    }
    element("told-belief").textContent = `Believed after it: ${belief.found} ${belief.reason}`;
  }

  const reasons = {
    initial: ", one of the ISIs that are asked first.", plan: ", by the strategy's own plan.",
    acquisition: ", where the score is highest.", again: " again, as its trial was lost.", fallback: ", by a fallback.",
  };
  const why = (belief) => reasons[belief.chosenBy] ?? ".";

  function tellNext(belief) {
    const next = trials[position + 1];
    const fallback = next && session.fallbacks[next.number];
    const told = element("told-next");
    if (!belief) told.textContent = "";
    else if (belief.stop) told.textContent = "Nothing was asked after it: the session stopped.";
    else if (belief.nextMs !== null) told.textContent = `Asked next: ${ms(belief.nextMs)}${fallback ? `, by a fallback: ${fallback}` : why(belief)}`;
    else told.textContent = next ? `Next came trial ${next.number}: ${next.asked}.` : "No ISI was asked after it.";
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
    drawBelief(trial.number);
    drawSweep(trial);
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
