"use strict";
// Shows what the session's server sends, and sends what the buttons say. Text from the log is only ever set as text.
(() => {
  const token = location.hash.slice(1);
  const element = (id) => document.getElementById(id);
  const options = { displayModeBar: false, responsive: true }; // plotly's own buttons would upload what is drawn
  const SILENT_MS = 8000; // the server says something every two seconds
  const AGAIN_MS = 1000;
  let shown = null;
  let swept = null; // the trial whose sweep is drawn

  // ---- words

  const ms = (value) => `${Math.round(value * 10) / 10} ms`;
  const said = (id, text) => { element(id).textContent = text; };

  function duration(seconds) {
    const whole = Math.round(seconds);
    return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")} min`;
  }

  const phases = {
    waiting: "The session has not begun.", running: "The session runs.",
    over: "The session has ended. This page shows its last state.",
  };

  function tellPhase() {
    const { phase, pause } = shown;
    element("phase").dataset.phase = phase;
    said("phase", phase === "paused" ? `Paused: ${pause} The device is disarmed.` : phases[phase]);
  }

  function tellLast(trial) {
    said("last", trial ? `${trial.number}: ${trial.outcome}` : "none yet");
    const realised = trial && trial.realised !== "–" ? `, realised ${trial.realised}` : "";
    said("last-more", trial ? `asked ${trial.asked}${realised}` : "");
  }

  function tellNext(belief, last) {
    const isOld = last && belief && Number(shown.beliefOf) < last.number;
    if (isOld) said("next", shown.phase === "running" ? "being chosen" : "–");
    else if (belief && belief.stop) said("next", "nothing");
    else said("next", belief && belief.nextMs !== null ? ms(belief.nextMs) : "–");
    const more = belief && belief.stop ? "the session stops" : belief && belief.nextMs === null ? "a control trial" : "";
    said("next-more", isOld ? "" : more);
  }

  function tellLeft() {
    const { left, leftS, delivered, most } = shown;
    said("left", left === null ? "–" : `at most ${left}`);
    said("left-more", left === null || leftS === null ? "known after two trials" : `about ${duration(leftS)} at the pace so far`);
    said("delivered", String(delivered));
    said("delivered-more", `of at most ${most}, mistrials and control trials included`);
  }

  function row(cells) {
    const line = document.createElement("tr");
    for (const cell of cells) line.append(Object.assign(document.createElement("td"), { textContent: cell }));
    return line;
  }

  function tellTables() {
    element("events").replaceChildren(...shown.events.map(([trial, kind, text]) => row([trial ?? "–", kind, text])).reverse());
    element("facts").replaceChildren(...shown.facts.map(row));
  }

  // ---- pictures

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const axis = (title, more = {}) => ({
    title: { text: title, font: { size: 13 } }, gridcolor: colour("line"), linecolor: colour("line"),
    zeroline: false, automargin: true, ...more,
  });
  const layout = (more) => ({
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("ink"), size: 12 },
    hovermode: "closest", ...more,
  });
  const markup = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");
  const line = (x, y, name, style, more = {}) => ({ x, y, name, mode: "lines", line: style, hoverinfo: "skip", ...more });

  function profile(belief) {
    if (!belief || !belief.isiMs.length) return [];
    const none = { width: 0, color: colour("blue") };
    return [
      line(belief.isiMs, belief.low, "", none, { showlegend: false }),
      line(belief.isiMs, belief.high, "90 % band of the expectation", none, { fill: "tonexty", fillcolor: "rgba(60,150,220,0.22)" }),
      line(belief.isiMs, belief.profile, "expected MEP", { width: 2, color: colour("blue") }),
    ];
  }

  const symbols = { counts: ["trial", "circle"], excluded: ["excluded", "circle-open"], mistrial: ["mistrial", "x-thin-open"] };

  function points(kind, lowestUv) {
    const [name, symbol] = symbols[kind];
    const paint = colour(kind === "mistrial" ? "red" : "ink");
    const placed = shown.drawn.trials.map((trial) => ({
      ...trial, x: trial.isiMs ?? (kind === "mistrial" ? trial.askedMs : null),
      y: kind === "mistrial" ? lowestUv : trial.mepUv === null ? null : Math.max(trial.mepUv, lowestUv),
    })).filter((trial) => trial.kind === kind && trial.x !== null && trial.y !== null);
    const last = shown.drawn.trials.at(-1).number;
    return {
      x: placed.map((trial) => trial.x), y: placed.map((trial) => trial.y), customdata: placed.map((trial) => trial.number),
      text: placed.map((trial) => trial.outcome), name, mode: "markers", type: "scatter",
      marker: { symbol, color: paint, size: placed.map((trial) => (trial.number === last ? 14 : 8)), line: { width: 2, color: paint } },
      hovertemplate: "trial %{customdata}<br>%{x:.1f} ms, %{text}<extra></extra>",
    };
  }

  function marks(belief) {
    if (!belief) return [];
    const edge = (value) => ({ low: shown.drawn.range[0], high: shown.drawn.range[1] })[value] ?? value;
    const window = belief.window.map(([x0, x1]) => ({
      type: "rect", x0, x1, yref: "paper", y0: 0, y1: 1, fillcolor: colour("blue"), opacity: 0.12, line: { width: 0 },
    }));
    const edges = [belief.start, belief.end].filter((pair) => belief.window.length && !pair.includes(null)).map((pair) => ({
      type: "line", x0: edge(pair[0]), x1: edge(pair[1]), yref: "paper", y0: 1, y1: 1, line: { width: 7, color: colour("blue") },
    }));
    const next = belief.nextMs === null ? [] : [{
      type: "line", x0: belief.nextMs, x1: belief.nextMs, yref: "paper", y0: 0, y1: 1,
      line: { width: 1.5, dash: "dash", color: colour("orange") },
    }];
    return [...window, ...edges, ...next];
  }

  function legend(belief) {
    const key = (name, style) => line([null], [null], name, style);
    return [
      ...(belief && belief.window.length ? [
        key("window", { width: 10, color: "rgba(60,150,220,0.3)" }),
        key("90 % interval of its edges", { width: 6, color: colour("blue") }),
      ] : []),
      ...(belief && belief.nextMs !== null ? [key("asked next", { width: 1.5, dash: "dash", color: colour("orange") })] : []),
    ];
  }

  function drawBelief(belief) {
    const { trials, range, reference } = shown.drawn;
    if (!trials.length && !belief) return;
    const sizesUv = [...trials.map((trial) => trial.mepUv), ...(belief ? [...belief.low, ...belief.high] : [])]
      .filter((size) => size !== null && size >= 1);
    const lowestUv = sizesUv.reduce((least, size) => Math.min(least, size), 10) * 0.8;
    const largestUv = sizesUv.reduce((most, size) => Math.max(most, size), 100) * 1.3;
    const after = { impact: "after the impact", valve: "after the valve command" }[reference];
    const traces = trials.length ? Object.keys(symbols).map((kind) => points(kind, lowestUv)) : [];
    Plotly.react("belief", [...profile(belief), ...traces, ...legend(belief)], layout({
      xaxis: axis(`ISI ${after} [ms]`, { range }),
      yaxis: axis("MEP [µV]", {
        type: "log", range: [Math.log10(lowestUv * 0.9), Math.log10(largestUv)],
        tickvals: [1, 10, 100, 1000, 10000].flatMap((ten) => [ten, 2 * ten, 5 * ten]),
      }),
      shapes: marks(belief), uirevision: "belief", margin: { l: 60, r: 12, t: 40, b: 44 },
      legend: { orientation: "h", y: 1.04, yanchor: "bottom", traceorder: "normal" },
    }), options);
  }

  function sweepMarks(trial, k) {
    const place = { xref: `x${k || ""}`, yref: `y${k || ""} domain`, y0: 0, y1: 1 };
    const at = { tms: trial.tmsMs, hit: trial.hitMs, valve: trial.valveMs };
    const lines = Object.entries(at).filter(([, x]) => x !== null).map(([name, x]) => ({
      type: "line", x0: x, x1: x, ...place,
      line: { width: 1.5, dash: name === "tms" ? "solid" : "dot", color: colour(name === "tms" ? "faint" : "orange") },
    }));
    if (trial.tmsMs === null) return lines;
    const [x0, x1] = shown.drawn.mepWindow.map((edge) => trial.tmsMs + edge);
    return [...lines, { type: "rect", x0, x1, ...place, fillcolor: colour("green"), opacity: 0.18, line: { width: 0 }, layer: "below" }];
  }

  function drawSweep(trial) {
    const figure = element("sweep");
    said("sweep-title", trial ? `Sweep of trial ${trial.number}` : "Last sweep");
    const waves = trial ? trial.sweep : [];
    if (!waves.length) {
      Plotly.purge(figure);
      figure.style.height = "auto";
      figure.textContent = trial ? "There are no waveforms of this trial." : "There was no trial yet.";
      return;
    }
    if (!figure.classList.contains("js-plotly-plot")) figure.textContent = "";
    figure.style.height = `${60 + 120 * (waves.length + 1)}px`;
    const share = 1 / (waves.length + 1); // the first, the EMG near the pulse, is twice as high
    const axes = {};
    const traces = waves.map((wave, k) => {
      const index = k ? k + 1 : "";
      const x = wave.values.map((_, n) => wave.t0 + n * wave.step);
      const top = k ? 1 - (k + 1) * share : 1;
      axes[`xaxis${index}`] = axis(k === waves.length - 1 ? "time of the sweep [ms]" : "", { range: [x[0], x[x.length - 1]], anchor: `y${index}` });
      axes[`yaxis${index}`] = axis(`${markup(wave.name)}<br>[${markup(wave.unit)}]`,
        { domain: [top - (k ? 0.7 : 1.7) * share, top], anchor: `x${index}` });
      return {
        x, y: wave.values, xaxis: `x${index}`, yaxis: `y${index}`, mode: "lines", showlegend: false,
        line: { width: 1, color: colour("ink") }, hovertemplate: "%{x:.1f} ms: %{y:.3g}<extra></extra>",
      };
    });
    const shapes = waves.flatMap((_, k) => sweepMarks(trial, k ? k + 1 : ""));
    Plotly.react(figure, traces, layout({ ...axes, shapes, margin: { l: 90, r: 12, t: 8, b: 44 } }), options);
  }

  // ---- all of it

  function showButtons(last) {
    const { phase } = shown;
    const focused = document.activeElement;
    element("operate").hidden = !["running", "paused"].includes(phase);
    element("pause").hidden = phase === "paused";
    element("resume").hidden = phase !== "paused";
    if (focused?.hidden) element(phase === "paused" ? "resume" : "pause").focus(); // the button that was pressed is gone
    element("exclude").disabled = !last || last.kind === "mistrial";
    said("exclude", last && last.kind === "excluded" ? `Count trial ${last.number} again` : "Exclude the last trial");
  }

  function show() {
    const { trials, beliefs } = shown.drawn;
    const last = trials.at(-1);
    const [number, belief] = Object.entries(beliefs)[0] ?? [null, null];
    shown.beliefOf = number;
    document.title = `${shown.phase === "paused" ? "Paused: " : ""}Session of ${shown.subject}`;
    said("title", `Session of ${shown.subject}`);
    tellPhase();
    said("found", belief ? belief.found : "Nothing is known yet.");
    said("reason", belief ? belief.reason : "");
    tellLast(last);
    tellNext(belief, last);
    tellLeft();
    tellTables();
    showButtons(last);
    element("now").hidden = false;
    later(draw);
  }

  // Words are painted first. Where news come faster than pictures, only the latest are drawn.
  let waiting = null;
  function later(task) {
    clearTimeout(waiting);
    waiting = setTimeout(task);
  }

  function draw() {
    drawBelief(Object.values(shown.drawn.beliefs)[0]);
    const last = shown.drawn.trials.at(-1);
    if (swept !== (last ? last.number : -1)) later(() => {
      swept = last ? last.number : -1;
      drawSweep(last);
    });
  }

  function repaint() {
    swept = null;
    if (shown) show();
  }

  // ---- the server

  const headers = { Authorization: `Bearer ${token}` };

  function trouble(text) {
    element("trouble").hidden = !text;
    said("trouble", text);
    document.body.classList.toggle("stale", Boolean(text));
  }

  async function send(call, body, words) {
    said("done", "");
    try {
      const answer = await fetch(call, {
        method: "POST", headers: { ...headers, "Content-Type": "application/json" }, body: JSON.stringify(body),
      });
      const { ok, error } = await answer.json();
      said("done", ok ? words : `Not done: ${error.message}`);
      return ok;
    } catch {
      said("done", "Not done: the session cannot be reached.");
      return false;
    }
  }

  async function* events(reader, alive) {
    const decoder = new TextDecoder();
    for (let text = ""; ;) {
      const { value, done } = await reader.read();
      if (done) return;
      alive();
      const parts = (text + decoder.decode(value, { stream: true })).split("\n\n");
      text = parts.pop();
      const news = parts.filter((part) => part.startsWith("data: "));
      if (news.length) yield JSON.parse(news.at(-1).slice(6)); // only the latest matters
    }
  }

  async function follow() {
    const given = new AbortController();
    let timer = 0;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(() => given.abort(), SILENT_MS);
    };
    alive();
    try {
      const answer = await fetch("updates", { headers, signal: given.signal, cache: "no-store" });
      if (answer.status === 401) throw new Error("401");
      for await (const news of events(answer.body.getReader(), alive)) {
        shown = news;
        trouble("");
        show();
      }
    } finally {
      clearTimeout(timer);
    }
  }

  async function followOn() {
    while (!shown || shown.phase !== "over") {
      try {
        await follow();
      } catch (error) {
        if (error.message === "401") {
          trouble("The address of this page is not the one that isiw printed. Open that one.");
          return;
        }
      }
      if (shown && shown.phase === "over") return;
      trouble(shown ? "No connection to the session: what is shown is old, and the buttons do nothing." : "The session cannot be reached.");
      await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS); });
    }
  }

  function askStop(asks) {
    element("stop").hidden = asks;
    element("stop-sure").hidden = element("stop-not").hidden = !asks;
    element(asks ? "stop-sure" : "stop").focus();
  }

  element("pause").addEventListener("click", () => send("pause", {}, "The device is disarmed; the session pauses."));
  element("resume").addEventListener("click", () => send("resume", { reason: shown.pause }, "The session goes on."));
  element("stop").addEventListener("click", () => askStop(true));
  element("stop-not").addEventListener("click", () => askStop(false));
  element("stop-sure").addEventListener("click", () => send("stop", {}, "The session ends."));
  element("exclude").addEventListener("click", () => {
    const { number, kind } = shown.drawn.trials.at(-1);
    if (kind === "excluded") send("include", { trial: number }, `Trial ${number} counts again.`);
    else send("exclude", { trial: number }, `Trial ${number} is excluded.`);
  });
  element("remark").addEventListener("submit", async (event) => {
    event.preventDefault();
    const text = element("note").value.trim();
    if (text && await send("note", { text }, "The note is in the log.")) element("note").value = "";
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  followOn();
})();
