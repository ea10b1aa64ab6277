"use strict";
// What is asked for goes out 20 times a second while this page has the controls; the operator's
// process has the team stand when it no longer comes. Stops have a socket of their own.

const PERIOD_MS = 50;
const DEAD_ZONE = 0.12; // of a gamepad's stick
const STOP_BUTTON = 1; // B, or circle
const HOLD_BUTTONS = [5, 7]; // the right shoulder and trigger
const NAMES = ["vx", "vy", "wz", "height"];
const UNITS = { vx: "m/s", vy: "m/s", wz: "rad/s", height: "m" };
const KEYS = {
  KeyW: ["vx", 1], KeyS: ["vx", -1], ArrowUp: ["vx", 1], ArrowDown: ["vx", -1],
  KeyQ: ["vy", 1], KeyE: ["vy", -1],
  KeyA: ["wz", 1], KeyD: ["wz", -1], ArrowLeft: ["wz", 1], ArrowRight: ["wz", -1],
};

const element = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token");
const pressed = new Set(); // keys that drive
let news = null; // the newest of the operator
let limits = null; // by name the least and the greatest that can be asked for
let pad = null; // where the pad is held, −1 … 1 to the right and upward; null: it is not
let held = false; // whether the button for the sliders is
let stopHeld = false; // whether the gamepad's stop button has been pressed and not released
let number = 0;

function connect(path, receive) {
  const link = { socket: null };
  const open = () => {
    link.socket = new WebSocket(`ws://${location.host}${path}?token=${token}`);
    link.socket.onmessage = (event) => receive(JSON.parse(event.data));
    link.socket.onclose = () => {
      receive({ kind: "gone" });
      setTimeout(open, 500);
    };
  };
  open();
  link.say = (body) => {
    if (link.socket.readyState !== WebSocket.OPEN) return false;
    link.socket.send(JSON.stringify({ number: number++, ...body }));
    return true;
  };
  return link;
}

const drive = connect("/drive", (told) => {
  if (told.kind === "gone") news = null;
  if (told.kind === "news") {
    news = told;
    if (limits === null) setLimits(told);
  }
  show();
});

const stop = connect("/stop", (told) => {
  if (told.kind === "gone") element("answer").textContent = "the operator is not there";
  if (told.kind === "stopped") {
    element("answer").textContent = told.missing.length
      ? `not stopped: ${told.missing.join(", ")} after ${told.ms} ms. Cut the power!`
      : `all stopped after ${told.ms} ms`;
  }
});

function pressStop() {
  const sent = stop.say({ kind: "estop", text: "page" });
  element("answer").textContent = sent ? "stopping …" : "NOT SENT: the operator is not there";
}

function setLimits(told) {
  limits = told.limits;
  for (const name of NAMES) {
    const slider = element(name);
    [slider.min, slider.max] = limits[name];
    slider.value = name === "height" ? told.asked.height : 0;
    slider.oninput = showSlider;
    slider.oninput();
  }
}

function showSlider() {
  this.nextElementSibling.textContent = `${Number(this.value).toFixed(2)} ${UNITS[this.id]}`;
}

const scale = (name, share) => (share < 0 ? -share * limits[name][0] : share * limits[name][1]);
const bend = (value) => (Math.abs(value) < DEAD_ZONE ? 0 : value);

// What the pad, the keys, the gamepad or the sliders ask for now; null: nobody holds any of them.
function wish() {
  const asked = { vx: 0, vy: 0, wz: 0, height: Number(element("height").value) };
  const gamepad = Array.from(navigator.getGamepads()).find((each) => each && each.connected);
  if (gamepad && HOLD_BUTTONS.some((k) => gamepad.buttons[k] && gamepad.buttons[k].pressed)) {
    asked.vx = scale("vx", bend(-gamepad.axes[1]));
    asked.vy = scale("vy", bend(-gamepad.axes[0]));
    asked.wz = scale("wz", bend(-(gamepad.axes[2] ?? 0)));
  } else if (pad) {
    asked.vx = scale("vx", pad.up);
    asked.wz = scale("wz", -pad.right);
  } else if (pressed.size) {
    for (const code of pressed) asked[KEYS[code][0]] += scale(...KEYS[code]) / 2;
  } else if (held) {
    for (const name of NAMES) asked[name] = Number(element(name).value);
  } else {
    return null;
  }
  return asked;
}

function watchStopButton() {
  const down = Array.from(navigator.getGamepads()).some(
    (each) => each && each.buttons[STOP_BUTTON] && each.buttons[STOP_BUTTON].pressed,
  );
  if (down && !stopHeld) pressStop();
  stopHeld = down;
}

const drives = () => news !== null && news.driver === news.you;

setInterval(() => {
  watchStopButton();
  if (!drives() || limits === null) {
    document.body.classList.remove("driving");
    return;
  }
  const asked = wish();
  const rest = { vx: 0, vy: 0, wz: 0, height: Number(element("height").value) };
  drive.say({ kind: "drive", held: asked !== null, ...(asked ?? rest) });
  document.body.classList.toggle("driving", asked !== null);
}, PERIOD_MS);

function show() {
  const here = news !== null;
  for (const id of ["take", "release", "stand", "go-on"]) element(id).disabled = !here;
  if (!here) {
    element("state").textContent = "no operator: it has ended, or this page's token is an old one";
    return;
  }
  element("take").disabled = !news.drivable || drives();
  element("release").disabled = !drives();
  element("drive").hidden = !news.drivable;
  element("state").textContent = drives()
    ? "you have the controls"
    : news.driver ? `${news.driver} has the controls` : news.stands;
  element("robots").replaceChildren(
    ...Object.entries(news.robots).map(([name, robot]) => row(name, robot.mode, robot.reason)),
  );
  const asked = NAMES.map((name) => `${name} ${news.asked[name].toFixed(2)}`);
  element("asked").textContent = `asked for now: ${asked.join(", ")}`;
}

function row(...cells) {
  const line = document.createElement("tr");
  for (const text of cells) line.insertCell().textContent = text;
  return line;
}

function movePad(event) {
  const box = element("pad").getBoundingClientRect();
  const clip = (value) => Math.max(-1, Math.min(1, value));
  pad = {
    right: clip((2 * (event.clientX - box.left)) / box.width - 1),
    up: clip(1 - (2 * (event.clientY - box.top)) / box.height),
  };
  element("knob").style.left = `${50 * (1 + pad.right)}%`;
  element("knob").style.top = `${50 * (1 - pad.up)}%`;
}

function letGo() {
  pad = null;
  held = false;
  pressed.clear();
  element("knob").style.left = element("knob").style.top = "50%";
}

element("pad").onpointerdown = (event) => {
  event.currentTarget.setPointerCapture(event.pointerId);
  movePad(event);
};
element("pad").onpointermove = (event) => pad && movePad(event);
element("pad").onpointerup = element("pad").onpointercancel = letGo;
element("hold").onpointerdown = (event) => {
  event.currentTarget.setPointerCapture(event.pointerId);
  held = true;
};
element("hold").onpointerup = element("hold").onpointercancel = letGo;
element("estop").onpointerdown = pressStop; // not onclick: that waits for the button's release
element("take").onclick = () => drive.say({ kind: "take" });
element("release").onclick = () => drive.say({ kind: "release" });
element("stand").onclick = () => drive.say({ kind: "stand", text: "page" });
element("go-on").onclick = () => drive.say({ kind: "go-on" });
element("reset").onsubmit = (event) => {
  event.preventDefault();
  drive.say({ kind: "reset", text: element("by").value });
};

addEventListener("keydown", (event) => {
  if (event.code === "Escape") return pressStop();
  if (event.target.id === "by" || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.code === "Space") held = true;
  else if (event.code in KEYS) pressed.add(event.code);
  else return;
  event.preventDefault();
});
addEventListener("keyup", (event) => {
  pressed.delete(event.code);
  if (event.code === "Space") held = false;
});
addEventListener("blur", letGo);
addEventListener("pagehide", () => drive.say({ kind: "release" }));
document.addEventListener("visibilitychange", () => document.hidden && letGo());

// The view starts beside the team, and may do so later than this page.
async function frameView(view, url) {
  element("no-view").textContent = "The view starts …";
  for (let found = false; !found; ) {
    found = await fetch(url, { mode: "no-cors" }).then(() => true, () => false);
    if (!found) await new Promise((resume) => setTimeout(resume, 500));
  }
  view.src = url;
  view.hidden = false;
  element("no-view").hidden = true;
}

const view = element("view");
if (view.dataset.src) frameView(view, view.dataset.src);
show();
