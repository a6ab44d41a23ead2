/** The token that a console beyond loopback wants: from the address, kept for this tab, and gone from the address bar. */

import { byId, setText } from "./dom.js";
import { closeSheet, openSheet } from "./popups.js";

const KEY = "airground.token";

function system() {
  const agent = navigator.userAgent;
  const known = [["iPhone", "iPhone"], ["iPad", "iPad"], ["Android", "Android"], ["Windows", "Windows"], ["Mac OS", "Mac"], ["Linux", "Linux"]];
  const where = known.find(([sign]) => agent.includes(sign))?.[1] ?? "computer";
  const browser = ["Firefox", "Edg", "Chrome", "Safari"].find((one) => agent.includes(one)) ?? "browser";
  return `${browser === "Edg" ? "Edge" : browser} on ${where}`;
}

/** @param {() => void} connect tries again */
export function makeToken(connect) {
  const given = new URLSearchParams(location.hash.slice(1));
  let token = given.get("token");
  try {
    if (token) sessionStorage.setItem(KEY, token);
    else token = sessionStorage.getItem(KEY);
  } catch {
    // Then it holds until the page is loaded again.
  }
  // An address is copied, shown and kept in histories: the token must not be in it.
  if (location.hash) history.replaceState(null, "", location.pathname + location.search);

  byId("token-form").addEventListener("submit", (event) => {
    event.preventDefault();
    token = byId("token-input").value.trim();
    try {
      sessionStorage.setItem(KEY, token);
    } catch {
      // As above.
    }
    closeSheet();
    connect();
  });
  return {
    get: () => token,
    name: (given.get("name") ?? system()).slice(0, 40),
    /** Ask for another one. */
    ask(line) {
      setText(byId("token-line"), token ? `The server says: ${line}.` : "It stands in the address that airground serve printed in its terminal.");
      openSheet(byId("token-sheet"));
    },
  };
}
