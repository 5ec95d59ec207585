"use strict";
// Shows what the session's server sends, and sends what the buttons say. Text from the log is only ever set as text.
(() => {
  const token = location.hash.slice(1);
  const element = (id) => document.getElementById(id);
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
    waiting: "The session has not begun.", running: "The session runs.", ending: "The session ends.",
    over: "The session has ended. This page shows its last state.",
  };

  function tellPhase() {
    const { phase, pause, unprotected } = shown;
    element("phase").dataset.phase = phase;
    const running = phase === "running" && unprotected ? ` ${unprotected}` : "";
    said("phase", phase === "paused" ? `Paused: ${pause.reason} The device is disarmed.` : `${phases[phase]}${running}`);
  }

  function tellLast(trial) {
    said("last", trial ? `${trial.number}: ${trial.outcome}` : "none yet");
    const realised = trial && trial.realised !== "–" ? `, realised ${trial.realised}` : "";
    said("last-more", trial ? `commanded ${trial.asked}${realised}` : "");
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

  function row(cells, headed) {
    const line = document.createElement("tr");
    cells.forEach((textContent, k) => {
      const heads = headed && !k;
      line.append(Object.assign(document.createElement(heads ? "th" : "td"), { textContent, ...(heads && { scope: "row" }) }));
    });
    return line;
  }

  function tellTables() {
    element("events").replaceChildren(...shown.events.map(([trial, kind, text]) => row([trial ?? "–", kind, text])).reverse());
    element("facts").replaceChildren(...shown.facts.map((fact) => row(fact, true)));
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
    said("dotted", shown.drawn.dotted);
    tellPhase();
    said("found", belief ? belief.found : "Nothing is known yet.");
    said("reason", belief ? belief.reason : "");
    tellLast(last);
    tellNext(belief, last);
    tellLeft();
    tellTables();
    showButtons(last);
    element("now").hidden = element("more").hidden = false;
    later(picture);
  }

  // Words are painted first. Where news come faster than pictures, only the latest are drawn.
  let waiting = null;
  function later(task) {
    clearTimeout(waiting);
    waiting = setTimeout(task);
  }

  function picture() {
    const last = shown.drawn.trials.at(-1);
    const [belief] = Object.values(shown.drawn.beliefs);
    if (last || belief) draw.belief("belief", shown.drawn, belief, last ? last.number : -1);
    if (swept !== (last ? last.number : -1)) later(() => {
      swept = last ? last.number : -1;
      said("sweep-title", last ? `Sweep of trial ${last.number}` : "Last sweep");
      draw.sweep("sweep", shown.drawn, last, last ? "There are no waveforms of this trial." : "There was no trial yet.");
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
  element("resume").addEventListener("click", () => send("resume", { pause: shown.pause.number }, "The session continues."));
  element("stop").addEventListener("click", () => askStop(true));
  element("stop-not").addEventListener("click", () => askStop(false));
  element("stop-sure").addEventListener("click", () => send("stop", {}, "The device is disarmed; the session ends before another stimulus."));
  element("exclude").addEventListener("click", () => {
    const { number, kind } = shown.drawn.trials.at(-1);
    if (kind === "excluded") send("include", { trial: number }, `Trial ${number} counts again.`);
    else send("exclude", { trial: number }, `Trial ${number} is excluded.`);
  });
  async function log(kind, said) {
    const text = element("note").value.trim();
    if (text && await send(kind, { text }, said)) element("note").value = "";
  }
  element("remark").addEventListener("submit", (event) => {
    event.preventDefault();
    log("note", "The note is in the log.");
  });
  const resized = new ResizeObserver((seen) => {
    for (const { target } of seen) if (target.classList.contains("js-plotly-plot")) Plotly.Plots.resize(target);
  });
  for (const id of ["belief", "sweep"]) resized.observe(element(id)); // words above them may take another line
  element("change").addEventListener("click", () => log("change", "The change is in the log; MEPs may differ from here on."));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  followOn();
})();
