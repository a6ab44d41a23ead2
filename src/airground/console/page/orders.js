/** Orders as they leave the page; the only place that sends them. */

import { holdsControls, store } from "./store.js";

/** @param {import("./connection.js").Connection} connection @param {(line: string, level?: string) => void} say */
export function makeOrders(connection, say) {
  /**
   * Send an order and say so where it was refused.
   * @param {object} order as session/orders.py has it
   * @returns {Promise<{ok: boolean, line: string}>}
   */
  async function send(order) {
    if (!connection.ready) {
      say("There is no connection: nothing was sent.", "error");
      return { ok: false, line: "no connection" };
    }
    if (!holdsControls()) {
      const holder = store.get("controls")?.name;
      say(`You are watching${holder ? `: ${holder} has the controls` : ""}. Take the controls first.`, "warning");
      return { ok: false, line: "watching" };
    }
    const reply = await connection.ask({ kind: "order", order });
    if (!reply.ok) say(reply.line || `The order ${order.kind} was refused.`, "error");
    return reply;
  }

  return {
    send,
    /** Many a second: no answer is waited for. */
    stream: (order) => holdsControls() && connection.stream({ kind: "order", order }),
    /** Anyone may; past all checks. @returns {boolean} whether it left */
    stop() {
      if (!connection.ready) return false;
      void connection.ask({ kind: "order", order: { kind: "stop" } });
      return true;
    },
  };
}
