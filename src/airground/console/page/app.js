/** Puts the page together. What comes in goes to the store; parts draw themselves when what they show has changed. */

import { BirdsEye } from "./birdseye.js";
import { Connection, VERSION } from "./connection.js";
import { makeControls } from "./controls.js";
import { byId, setText } from "./dom.js";
import { expose } from "./debug.js";
import { makeEvents } from "./events.js";
import { makeKeys } from "./keys.js";
import { makeOrders } from "./orders.js";
import { calibratePanel } from "./panels/calibrate.js";
import { contextLine } from "./panels/context.js";
import { header } from "./panels/header.js";
import { makeHelp, makeLayersMenu } from "./panels/help.js";
import { othersPanel } from "./panels/others.js";
import { robotsPanel } from "./panels/robots.js";
import { makeSwap, makeTabs } from "./panels/tabs.js";
import { Plots } from "./plots.js";
import { closeSheet, openSheet, togglePop } from "./popups.js";
import { makeStop } from "./stop.js";
import { chosenRobot, store } from "./store.js";
import { makeToken } from "./token.js";
import { makeTools } from "./tools.js";
import { Trails } from "./trails.js";
import { View } from "./view.js";

const BAD_TOKEN = 4401, BAD_VERSION = 4409;
const IMAGE_HZ = 15;

const trails = new Trails();
const events = makeEvents();
const token = makeToken(() => connection.open());

const connection = new Connection({
  token: token.get,
  name: token.name,
  onState: (state) => store.set("connection", state),
  onData: receive,
  onImage: (...image) => view.take(...image),
  onRefusal: (line) => events.say(line, "warning"),
  onClosed(code, reason) {
    if (code === BAD_TOKEN) token.ask(reason);
    if (code === BAD_VERSION) outOfDate(reason);
    return code === BAD_TOKEN || code === BAD_VERSION;
  },
});
const orders = makeOrders(connection, events.say);
const stop = makeStop({ orders, connection, log: events.log });

function choose(name) {
  store.change("chosen", name);
}

const redraw = () => {
  view?.drawOverlay();
  bird?.drawOverlay();
  context?.();
};
let view = null, bird = null, context = null;
const tools = makeTools({ orders, choose, changed: redraw, say: events.say });
view = new View({ trails, tools });
bird = new BirdsEye({ trails, tools });
view.surface.tool = bird.surface.tool = tools;
view.onImage = (_, bitmap) => bird.take(bitmap);
context = contextLine({ tools });
const plots = new Plots();

const openTab = makeTabs();
const swap = makeSwap();
const help = makeHelp();
makeLayersMenu();
makeControls({ connection, orders, say: events.say });
header({ connection, view });
robotsPanel({ orders, choose });
othersPanel();
calibratePanel({ orders, openTab, takeTool: (name) => tools.take(name) });
const large = () => (byId("slot-main").contains(view.surface.base) ? view.surface : bird.surface);
makeKeys({ tools, surfaces: large, choose, orders, openTab, swap, help });
// On a phone there is a button for the whole image only where it is not seen.
view.onZoom = () => document.querySelector(".corner").classList.toggle("zoomed", view.surface.viewport.zoom > 1.01);
byId("zoom-in").addEventListener("click", () => view.surface.zoom(1.4));
byId("zoom-out").addEventListener("click", () => view.surface.zoom(1 / 1.4));
byId("zoom-fit").addEventListener("click", () => view.surface.fit());
byId("layers-button").addEventListener("click", () => togglePop(byId("layers-menu"), byId("layers-button")));
byId("reload").addEventListener("click", () => location.reload());

store.on(["state", "calibration", "layers", "chosen", "paths", "discarded", "fences"], redraw);
store.on(["theme"], () => bird.drawImage());
view.onSize = askForImages;

let asked = "";
/** Say what images are wanted; again where the size of the page has changed. */
function askForImages() {
  const width = view.wantedWidth();
  store.set("imageWidth", width);
  const message = { kind: "view", image: !document.hidden, rate_hz: IMAGE_HZ, width_px: width };
  if (JSON.stringify(message) !== asked && connection.send(message)) asked = JSON.stringify(message);
}

function outOfDate(line) {
  setText(byId("version-line"), `${line}. This page speaks version ${VERSION} of the protocol. Load it again; robots stop where nobody holds the controls.`);
  openSheet(byId("version-note"));
}

/** @param {string} key @param {any} data */
function receive(key, data) {
  const [kind, ...rest] = key.split("/");
  const name = rest.join("/");
  if (kind === "hello") return greeted(data);
  if (kind === "event") return events.event(data);
  if (kind === "path") {
    const paths = new Map(store.get("paths"));
    if (data) paths.set(name, data);
    else paths.delete(name);
    return store.set("paths", paths);
  }
  if (kind === "state") {
    for (const robot of data.robots) if (robot.uv) trails.add(data.t, robot.name, robot.uv);
    for (const other of data.others) trails.add(data.t, `other ${other.name}`, other.uv);
    trails.age(data.t);
    plots.add(data);
  }
  return store.set(key, data);
}

function greeted(hello) {
  if (hello.version !== VERSION) {
    connection.end();
    return outOfDate(`The server speaks version ${hello.version}`);
  }
  closeSheet();
  // What was known belongs to another conversation; the server tells all of it again.
  store.set("paths", new Map());
  store.set("controls", null);
  events.forget();
  store.set("hello", hello);
  const names = hello.site.robots.map((robot) => robot.name);
  if (!names.includes(store.get("chosen"))) store.set("chosen", names[0] ?? null);
  asked = "";
  return askForImages();
}

expose({ store, view, bird, connection, tools, events, stop, chosenRobot });
connection.open();
