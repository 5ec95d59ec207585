"use strict";
// What the panel shows, as a pure function of the session's last news and of how long ago they came. It touches no element.
const panel = (() => {
  const SILENT_MS = 3000; // the server says something every second
  const none = "not reported";
  const ms = (value) => `${Math.round(value * 10) / 10} ms`;
  const figure = (value, unit) => (value === null ? none : `${Math.round(value * 10) / 10} ${unit}`);
  const clock = (seconds) => {
    const whole = Math.ceil(Math.max(0, seconds));
    return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
  };
  const lost = "Use the stimulator's own switch.";

  // The bar: its word, what it says below it, and the lamp. The news are `ageMs` old.
  function bar(news, connected, ageMs) {
    if (!news) return { state: "NO CONNECTION", count: "", line: lost, more: "The session cannot be reached.", armed: null };
    if (!news.over && !connected) {
      return { state: "NO CONNECTION", count: "", line: lost, more: "What is shown below is old, and the buttons do nothing.", armed: null };
    }
    const { state, pause, fault, waitS, armed } = news;
    const sentence = armed && news.unprotected ? `${news.sentence} ${news.unprotected}` : news.sentence;
    const left = waitS === null ? null : waitS - ageMs / 1000;
    if (state === "FAULT") return { state, count: "", line: fault.do, more: fault.what, armed };
    if (state === "PAUSED") return { state, count: "", line: pause.reason, more: "", armed };
    if (state === "REST") return { state, count: left === null ? "" : clock(left), line: sentence, more: "", armed };
    return { state, count: "", line: sentence, more: state === "RUNS" && left !== null ? `Next pulse in ${clock(left)}` : "", armed };
  }

  // Which buttons can be pressed; none without a connection.
  function buttons(state, last) {
    const runs = state === "RUNS" || state === "REST";
    return {
      pause: runs, resume: state === "PAUSED", stop: runs || state === "PAUSED",
      exclude: (runs || state === "PAUSED") && Boolean(last) && last.kind !== "mistrial",
      note: runs || state === "PAUSED", change: runs || state === "PAUSED",
    };
  }

  function next(news, last) {
    if (news.hides) return "concealed";
    const [number, belief] = Object.entries(news.drawn.beliefs)[0] ?? [null, null];
    if (last && belief && Number(number) < last.number) return news.state === "RUNS" ? "being chosen" : "–";
    if (!belief) return "–";
    if (belief.stop) return "nothing, it stops";
    return belief.nextMs === null ? "a control trial" : ms(belief.nextMs);
  }

  function values(news) {
    const last = news.drawn.trials.at(-1) ?? null;
    const { left, leftS, backgroundUv, limitUv } = news;
    const limit = limitUv === null ? "no limit" : `limit ${limitUv} µV`;
    return {
      last: last ? last.outcome : "none yet",
      lastMore: last ? `trial ${last.number}, commanded ${last.asked}${last.realised === "–" ? "" : `, realised ${last.realised}`}` : "",
      background: figure(backgroundUv, "µV"), backgroundMore: backgroundUv === null ? "" : limit,
      loud: backgroundUv !== null && limitUv !== null && backgroundUv > limitUv,
      left: left === null ? "–" : `${left}`,
      leftMore: left === null || leftS === null ? `${news.delivered} of at most ${news.most} given` : `about ${clock(leftS)} min; ${news.delivered} of at most ${news.most} given`,
      coil: figure(news.coilC, "°C"), intensity: figure(news.intensityPct, "% MSO"), next: next(news, last),
    };
  }

  // The last ten trials as bars: heights are shares of the largest.
  function strip(trials) {
    const ten = trials.slice(-10);
    const most = Math.max(1, ...ten.map((trial) => trial.mepUv ?? 0));
    return ten.map(({ number, kind, mepUv, outcome }) => ({ number, kind, outcome, share: (mepUv ?? 0) / most }));
  }

  function view(news, connected, ageMs) {
    const shown = bar(news, connected, ageMs);
    const last = news ? news.drawn.trials.at(-1) ?? null : null;
    return {
      bar: shown, buttons: buttons(shown.state, last), values: news ? values(news) : null,
      strip: news ? strip(news.drawn.trials) : [], exclude: last && last.kind === "excluded" ? "Count it again" : "Exclude the last",
    };
  }

  // What a key means, as in the terminal; a key that is held means nothing more.
  const keys = { p: "pause", r: "resume", q: "stop", x: "exclude", u: "exclude", n: "note", c: "change" };
  function pressed(event, state, isTyping) {
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || isTyping) return null;
    const act = keys[event.key.toLowerCase()] ?? null;
    return act === "stop" && state !== "PAUSED" ? null : act; // in the terminal q answers a pause alone
  }

  return { view, pressed, SILENT_MS };
})();
