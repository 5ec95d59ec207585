"use strict";
// Shows what the session's server sends, and sends what the buttons say. Text from the log is only ever set as text.
(() => {
  const token = location.hash.slice(1);
  const element = (id) => document.getElementById(id);
  const AGAIN_MS = 1000;
  let news = null;
  let heardAt = null; // when something was heard last; null while there is no connection
  let newsAt = 0; // when the news came that are shown
  let swept = null; // the trial whose sweep is drawn
  let shown = null; // what the panel shows

  const said = (id, text) => { if (element(id).textContent !== text) element(id).textContent = text; };

  // ---- the panel, which shows what `panel.view` says

  function show() {
    const now = performance.now();
    const connected = heardAt !== null && now - heardAt < panel.SILENT_MS;
    shown = panel.view(news, connected, now - newsAt);
    const { bar, buttons, values } = shown;
    element("bar").dataset.state = bar.state;
    said("state", bar.state);
    said("count", bar.count);
    said("line", bar.line);
    said("more", bar.more);
    element("lamp").dataset.armed = bar.armed ?? "";
    said("lamp", bar.armed === null ? "armed: not known" : bar.armed ? "ARMED" : "not armed");
    for (const [id, works] of Object.entries(buttons)) element(id).setAttribute("aria-disabled", String(!works));
    element("log").setAttribute("aria-disabled", String(!buttons.note));
    document.body.classList.toggle("stale", bar.state === "NO CONNECTION");
    said("exclude", shown.exclude);
    if (!values) return;
    for (const id of ["last", "background", "left", "coil", "intensity", "next"]) said(id, values[id]);
    for (const id of ["last", "background", "left"]) said(`${id}-more`, values[`${id}More`]);
    element("background").classList.toggle("loud", values.loud);
    document.title = `${bar.state}: session of ${news.subject}`;
  }

  function showStrip() {
    element("strip").replaceChildren(...shown.strip.map(({ number, kind, outcome, share }) => {
      const bar = Object.assign(document.createElement("span"), { className: kind, title: `trial ${number}: ${outcome}` });
      bar.style.setProperty("--share", share);
      return bar;
    }));
  }

  function row(cells, headed) {
    const line = document.createElement("tr");
    cells.forEach((textContent, k) => {
      const heads = headed && !k;
      line.append(Object.assign(document.createElement(heads ? "th" : "td"), { textContent, ...(heads && { scope: "row" }) }));
    });
    return line;
  }

  function showWords() {
    const [belief] = Object.values(news.drawn.beliefs);
    said("title", `Session of ${news.subject}`);
    said("dotted", news.drawn.dotted);
    said("found", belief ? belief.found : "Nothing is known yet.");
    said("reason", belief ? belief.reason : "");
    element("against").replaceChildren(...(belief ? belief.against : []).map((textContent) => (
      Object.assign(document.createElement("p"), { className: "warning", textContent }))));
    element("events").replaceChildren(...news.events.map(([trial, kind, text]) => row([trial ?? "–", kind, text])).reverse());
    element("facts").replaceChildren(...news.facts.map((fact) => row(fact, true)));
  }

  // Words are painted first. Where news come faster than pictures, only the latest are drawn.
  let waiting = null;
  function later(task) {
    clearTimeout(waiting);
    waiting = setTimeout(task);
  }

  function picture() {
    const last = news.drawn.trials.at(-1);
    const [belief] = Object.values(news.drawn.beliefs);
    if (last || belief) draw.belief("belief", news.drawn, belief, last ? last.number : -1);
    if (swept !== (last ? last.number : -1)) later(() => {
      swept = last ? last.number : -1;
      said("sweep-title", last ? `Sweep of trial ${last.number}` : "Last sweep");
      draw.sweep("sweep", news.drawn, last, last ? "There are no waveforms of this trial." : "There was no trial yet.");
    });
  }

  function take(sent) {
    news = sent;
    newsAt = performance.now();
    show();
    showStrip();
    showWords();
    later(picture);
  }

  // ---- the server

  const headers = { Authorization: `Bearer ${token}` };

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

  async function* events(reader) {
    const decoder = new TextDecoder();
    for (let text = ""; ;) {
      const { value, done } = await reader.read();
      if (done) return;
      heardAt = performance.now();
      const parts = (text + decoder.decode(value, { stream: true })).split("\n\n");
      text = parts.pop();
      const sent = parts.filter((part) => part.startsWith("data: "));
      if (sent.length) yield JSON.parse(sent.at(-1).slice(6)); // only the latest matters
    }
  }

  async function follow() {
    const given = new AbortController();
    const begunAt = performance.now();
    const listening = setInterval(() => { // a connection that is silent is given up
      if (performance.now() - Math.max(begunAt, heardAt ?? 0) >= panel.SILENT_MS) given.abort();
    }, AGAIN_MS / 2);
    try {
      const answer = await fetch("updates", { headers, signal: given.signal, cache: "no-store" });
      if (answer.status === 401) throw new Error("401");
      for await (const sent of events(answer.body.getReader())) take(sent);
    } finally {
      clearInterval(listening);
    }
  }

  async function followOn() {
    while (!(news && news.over)) {
      try {
        await follow();
      } catch (error) {
        if (error.message === "401") {
          clearInterval(ticking);
          said("line", "The address of this page is not the one that isiw printed. Open that one.");
          return;
        }
      }
      if (news && news.over) return;
      heardAt = null;
      show();
      await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS); });
    }
  }

  // ---- what is pressed

  const acts = {
    pause: () => send("pause", {}, "The device is disarmed; the session pauses."),
    resume: () => send("resume", { pause: news.pause.number }, "The session continues."),
    stop: () => send("stop", {}, "The device is disarmed; the session ends, and can be resumed later."),
    exclude: () => {
      const { number, kind } = news.drawn.trials.at(-1);
      if (kind === "excluded") send("include", { trial: number }, `Trial ${number} counts again.`);
      else send("exclude", { trial: number }, `Trial ${number} is excluded.`);
    },
    note: () => log("note", "The note is in the log."),
    change: () => log("change", "The change is in the log; MEPs may differ from here on."),
  };

  async function log(kind, words) {
    const text = element("note").value.trim();
    if (!text) element("note").focus();
    else if (await send(kind, { text }, words)) element("note").value = "";
  }

  function act(name) {
    if (shown && shown.buttons[name]) acts[name]();
  }

  for (const name of ["pause", "resume", "stop", "exclude", "change"]) element(name).addEventListener("click", () => act(name));
  element("remark").addEventListener("submit", (event) => {
    event.preventDefault();
    act("note");
  });
  document.addEventListener("keydown", (event) => {
    const isTyping = event.target.matches("input");
    if (event.repeat && event.target.matches("button")) event.preventDefault(); // a held Enter is one press
    const name = panel.pressed(event, shown ? shown.bar.state : "", isTyping);
    if (!name) return;
    event.preventDefault();
    if (name !== "exclude" || (event.key.toLowerCase() === "u") === (shown.exclude === "Count it again")) act(name);
  });
  const resized = new ResizeObserver((seen) => {
    for (const { target } of seen) if (target.classList.contains("js-plotly-plot")) Plotly.Plots.resize(target);
  });
  for (const id of ["belief", "sweep"]) resized.observe(element(id)); // words above them may take another line
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    swept = null;
    if (news) take(news);
  });
  const ticking = setInterval(show, 250);
  followOn();
})();
