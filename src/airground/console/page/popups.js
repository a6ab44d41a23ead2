/** Small panels by their button, and sheets over the page. None is modal: STOP must stay within reach. */

let open = null; // {panel, button}

/** @param {HTMLElement} panel @param {HTMLElement} button it belongs to: placed beneath or beside, inside the window */
export function openPop(panel, button) {
  closePop(false);
  panel.hidden = false;
  const at = button.getBoundingClientRect();
  const { offsetWidth: w, offsetHeight: h } = panel;
  const { clientWidth: W, clientHeight: H } = document.documentElement;
  const beside = at.width < 80 && at.left < 80 && W > 999;
  const left = beside ? at.right + 8 : Math.min(Math.max(at.right - w, 8), W - w - 8);
  const top = beside ? at.bottom - h : at.bottom + 6;
  panel.style.left = `${Math.max(left, 8)}px`;
  panel.style.top = `${Math.min(Math.max(top, 8), Math.max(H - h - 8, 8))}px`;
  button.setAttribute("aria-expanded", "true");
  open = { panel, button };
}

/** @returns {boolean} whether one was open */
export function closePop(focus = true) {
  if (!open) return false;
  open.panel.hidden = true;
  open.button.setAttribute("aria-expanded", "false");
  if (focus && open.panel.contains(document.activeElement)) open.button.focus();
  open = null;
  return true;
}

/** Open or close. */
export function togglePop(panel, button) {
  if (open?.panel === panel) closePop();
  else openPop(panel, button);
}

document.addEventListener("pointerdown", (event) => {
  if (open && !open.panel.contains(event.target) && !open.button.contains(event.target)) closePop(false);
}, true);
window.addEventListener("resize", () => closePop());

let sheet = null; // {node, before}

/** Lay a sheet over the page, and put the focus into it. */
export function openSheet(node) {
  if (sheet?.node === node) return;
  closeSheet();
  sheet = { node, before: document.activeElement };
  node.hidden = false;
  (node.querySelector("input, button") ?? node).focus();
}

/** @returns {boolean} whether one was open */
export function closeSheet() {
  if (!sheet) return false;
  sheet.node.hidden = true;
  sheet.before?.focus?.();
  sheet = null;
  return true;
}

/** Keep the focus inside a sheet, STOP included. */
document.addEventListener("focusin", (event) => {
  if (!sheet || sheet.node.contains(event.target) || event.target.closest("#stop-block")) return;
  (sheet.node.querySelector("input, button") ?? sheet.node).focus();
});
