"use strict";
// What the pages of a session draw with plotly: a belief with the trials, and a sweep. Sessions are as `isiw.report.drawn` gives them.
const draw = (() => {
  const names = { counts: "trial", other: "trial at another intensity", excluded: "excluded", mistrial: "mistrial" };
  const options = { displayModeBar: false, responsive: true }; // plotly's own buttons would upload what is drawn
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const axis = (title, more = {}) => ({
    title: { text: title, font: { size: 13 } }, gridcolor: colour("line"), linecolor: colour("line"),
    zeroline: false, automargin: true, ...more,
  });
  const layout = (more) => ({
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("ink"), size: 12 },
    margin: { l: 60, r: 12, t: 12, b: 44 }, hovermode: "closest", ...more,
  });
  const markup = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");

  // ---- the belief after a trial

  const ticksUv = [1, 10, 100, 1000, 10000].flatMap((ten) => [ten, 2 * ten, 5 * ten]);

  // The lowest and the highest amplitude that pictures of a session have room for.
  function limitsUv(session) {
    const sizes = [...session.trials.map((trial) => trial.mepUv), ...Object.values(session.beliefs)
      .flatMap((belief) => [...belief.low, ...belief.high, ...belief.predictedLow, ...belief.predictedHigh])];
    const positive = sizes.filter((size) => size !== null && size >= 1);
    const lowest = positive.reduce((least, size) => Math.min(least, size), 10) * 0.8;
    return [lowest, positive.reduce((most, size) => Math.max(most, size), 100) * 1.8]; // a whole mark, below the bars
  }

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

  // A mistrial is drawn at its ISI, or at the commanded one if nothing came, at most at an end of the picture; and at the lower
  // edge if no MEP was measured.
  // Beside the range is room for whole points at its ends, and at its left a strip for TMS alone.
  const [roomShare, aloneShare] = [0.02, 0.06];
  function placesMs(session) {
    const [low, high] = session.range;
    const isis = session.trials.filter((trial) => ["counts", "other"].includes(trial.kind) && trial.isiMs !== null).map((trial) => trial.isiMs);
    const [least, most] = isis.reduce(([min, max], isi) => [Math.min(min, isi), Math.max(max, isi)], [low, high]);
    const room = roomShare * (high - low);
    if (!session.trials.some((trial) => trial.isAlone)) return { aloneMs: null, range: [least - room, most + room] };
    const aloneMs = least - aloneShare * (high - low);
    return { aloneMs, partMs: (least + aloneMs) / 2, range: [2 * aloneMs - least + room, most + room] };
  }
  const inside = (x, [low, high]) => (x === null ? null : Math.min(Math.max(x, low), high));
  const placeMs = (trial, places) => (trial.isAlone ? places.aloneMs
    : trial.kind === "mistrial" ? inside(trial.isiMs ?? trial.askedMs, places.range) : trial.isiMs);
  const measuredUv = (trial, lowestUv) => (trial.mepUv === null ? null : Math.max(trial.mepUv, lowestUv));
  const heightUv = (trial, lowestUv) => measuredUv(trial, lowestUv) ?? (trial.kind === "mistrial" ? lowestUv : null);

  function trialTrace(trials, kind, number, lowestUv, places) {
    const symbol = { counts: "circle", other: "triangle-up", excluded: "circle-open", mistrial: "x-thin-open" }[kind];
    const shown = trials.filter((trial) => trial.kind === kind && placeMs(trial, places) !== null && heightUv(trial, lowestUv) !== null);
    return {
      x: shown.map((trial) => placeMs(trial, places)), y: shown.map((trial) => heightUv(trial, lowestUv)),
      text: shown.map((trial) => `${trial.realised === "–" ? trial.asked : trial.realised}, ${trial.outcome}`),
      customdata: shown.map((trial) => trial.number), name: names[kind], mode: "markers", type: "scatter", cliponaxis: false,
      marker: {
        symbol, size: shown.map((trial) => (trial.number === number ? 14 : 8)),
        color: colour({ mistrial: "red", other: "faint" }[kind] ?? "ink"),
        opacity: shown.map((trial) => (trial.number > number ? 0.18 : 1)),
        line: { width: kind === "mistrial" ? 2 : 1, color: colour(kind === "mistrial" ? "red" : "ink") },
      },
      hovertemplate: "trial %{customdata}<br>%{text}<extra></extra>",
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

  function beliefShapes(belief, range) {
    if (!belief) return [];
    const edge = (value) => (value === "low" ? range[0] : value === "high" ? range[1] : value);
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

  // The strip of TMS alone: its name below the axis, and the line that parts it from the range.
  function strip({ aloneMs, partMs }) {
    if (aloneMs === null) return { shapes: [], annotations: [] };
    return {
      shapes: [{ type: "line", x0: partMs, x1: partMs, yref: "paper", y0: 0, y1: 1, line: { width: 1, color: colour("faint") } }],
      annotations: [{ x: aloneMs, y: 0, yref: "paper", xanchor: "right", xshift: 12, yanchor: "top", text: "TMS<br>alone", showarrow: false }],
    };
  }

  function legend(belief) {
    const key = (name, style) => line([null], [null], name, style);
    const found = belief && belief.window.length ? [
      key("window", { width: 10, color: "rgba(60,150,220,0.3)" }),
      ...intervals(belief).map(([name, hue]) => key(`90 % interval of its ${name}`, { width: 6, color: colour(hue) })),
    ] : [];
    const next = belief && belief.nextMs !== null
      ? [key("next ISI", { width: 1.5, dash: "dash", color: colour("ink") })] : [];
    return [...found, ...next];
  }

  // Draws a belief with the trials, in an element with this id; the trial with this number stands out, later ones are pale.
  function belief(id, session, believed, number) {
    const [lowestUv, largestUv] = limitsUv(session);
    const places = placesMs(session);
    const { shapes, annotations } = strip(places);
    const points = session.trials.length
      ? Object.keys(names).map((kind) => trialTrace(session.trials, kind, number, lowestUv, places)) : [];
    const traces = [...profileTraces(believed), ...points, ...scoreTraces(believed), ...legend(believed)];
    Plotly.react(id, traces, layout({
      xaxis: axis(session.isiAxis, { range: places.range, anchor: isScored(believed) ? "y2" : "y" }),
      yaxis2: axis("score", { domain: [0, 0.2], visible: isScored(believed), showticklabels: false }),
      yaxis: axis("MEP [µV]", {
        domain: isScored(believed) ? [0.26, 1] : [0, 1], type: "log", tickvals: ticksUv,
        range: [Math.log10(lowestUv * 0.9), Math.log10(largestUv)],
      }),
      shapes: [...beliefShapes(believed, session.range), ...shapes], annotations, uirevision: id, margin: { l: 60, r: 12, t: 60, b: 44 },
      legend: { orientation: "h", y: 1.04, yanchor: "bottom", traceorder: "normal" },
    }), options);
  }

  // ---- the sweep of a trial

  const mark = (x, index, name) => ({
    type: "line", x0: x, x1: x, xref: `x${index || ""}`, yref: `y${index || ""} domain`, y0: 0, y1: 1,
    line: { width: 1.5, dash: name === "tms" ? "solid" : "dot", color: colour(name === "tms" ? "faint" : "orange") },
  });

  function sweepMarks(trial, index, mepWindow) {
    const at = { tms: trial.tmsMs, hit: trial.hitMs, valve: trial.valveMs };
    const zero = trial.tmsMs ?? 0;
    const lines = Object.entries(at).filter(([, x]) => x !== null).map(([name, x]) => mark(x - zero, index, name));
    if (trial.tmsMs === null) return lines;
    const [low, high] = mepWindow;
    return [...lines, {
      type: "rect", x0: low, x1: high, xref: `x${index || ""}`, yref: `y${index || ""} domain`, y0: 0, y1: 1,
      fillcolor: colour("green"), opacity: 0.18, line: { width: 0 }, layer: "below",
    }];
  }

  // Draws the sweep of a trial in an element with this id, or says there that there is none.
  function sweep(id, session, trial, nothing) {
    const waves = trial ? trial.sweep : [];
    const figure = document.getElementById(id);
    if (!waves.length) {
      Plotly.purge(figure);
      figure.style.setProperty("--rows", 0);
      figure.textContent = nothing;
      return;
    }
    if (!figure.classList.contains("js-plotly-plot")) figure.textContent = "";
    figure.style.setProperty("--rows", waves.length + 1);
    const traces = [];
    const axes = {};
    const shapes = [];
    const annotations = [];
    const share = 1 / (waves.length + 1); // the first, the EMG near the pulse, is twice as high
    waves.forEach((wave, k) => {
      const index = k ? k + 1 : "";
      const x = wave.values.map((_, n) => wave.t0 + n * wave.step - (trial.tmsMs ?? 0)); // 0 at the pulse
      const [top, height] = k ? [1 - (k + 1) * share, share] : [1, 2 * share];
      traces.push({
        x, y: wave.values, xaxis: `x${index}`, yaxis: `y${index}`, mode: "lines", showlegend: false,
        line: { width: 1, color: colour("ink") }, hovertemplate: "%{x:.1f} ms: %{y:.3g}<extra></extra>",
      });
      axes[`xaxis${index}`] = axis(k === waves.length - 1 ? trial.tmsMs === null ? "time of the sweep [ms]" : "time after the pulse [ms]" : "",
        { range: [x[0], x[x.length - 1]], anchor: `y${index}`, showticklabels: !k || k === waves.length - 1 });
      const gap = (k ? 0.15 : 0.6) * share; // the first has its own times below it, the others those of the last
      const ticks = k ? { nticks: 3 } : {};
      axes[`yaxis${index}`] = axis("", { domain: [top - height + gap, top], anchor: `x${index}`, ...ticks, ...(wave.axis && { range: wave.axis }) });
      annotations.push({
        text: `${markup(wave.name)} [${markup(wave.unit)}]`, showarrow: false, bgcolor: colour("paper"), opacity: 0.85,
        x: 0, xref: "paper", xanchor: "left", xshift: 4, y: 1, yref: `y${index} domain`, yanchor: "top",
      });
      shapes.push(...sweepMarks(trial, index, session.mepWindow));
    });
    Plotly.react(figure, traces, layout({ ...axes, shapes, annotations, margin: { l: 60, r: 12, t: 8, b: 44 } }), options);
  }

  return { belief, sweep };
})();
