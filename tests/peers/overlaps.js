// For page.evaluate(): a list of what is wrong with the layout of the page that is shown; empty where all is well.
// - texts that lie over each other, unless one is part of a layer that is meant to cover (toast, menu, sheet);
// - texts that are cut off by their own box, apart from those that end in an ellipsis and say so by their title;
// - controls and texts that are outside of the window, or scroll the page;
// - controls that are smaller than 24 x 24 px, or covered;
// - texts whose contrast to what is behind them is below 4.5 (3 for large ones), disabled controls apart.
(() => {
  const faults = [];
  const W = document.documentElement.clientWidth, H = document.documentElement.clientHeight;
  const LAYERS = ".toasts, .pop, .sheet, .unseen, noscript";
  const layer = (node) => node.closest(LAYERS);
  const seen = (node) => {
    const style = getComputedStyle(node);
    return style.visibility !== "hidden" && style.display !== "none" && Number(style.opacity) > 0.05 && node.getClientRects().length > 0;
  };
  // What of a box can be seen inside the boxes that scroll or clip it.
  const clipped = (box, node) => {
    let { left, top, right, bottom } = box;
    for (let up = node; up && up !== document.body; up = up.parentElement) {
      const style = getComputedStyle(up);
      if (style.overflowX === "visible" && style.overflowY === "visible") continue;
      const at = up.getBoundingClientRect();
      left = Math.max(left, at.left); top = Math.max(top, at.top); right = Math.min(right, at.right); bottom = Math.min(bottom, at.bottom);
    }
    return right - left > 1 && bottom - top > 1 ? { left, top, right, bottom } : null;
  };
  const texts = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const text = walk.currentNode;
    const node = text.parentElement;
    if (!text.data.trim() || !seen(node) || node.closest(".unseen, noscript, script, style, svg")) continue;
    const range = document.createRange();
    range.selectNodeContents(text);
    for (const box of range.getClientRects()) {
      const part = clipped(box, node);
      if (part) texts.push({ node, words: text.data.trim().slice(0, 40), whole: box, ...part });
    }
    const style = getComputedStyle(node);
    const ellipsis = style.textOverflow === "ellipsis" && node.title;
    if (!ellipsis && style.overflowX !== "visible" && style.overflowX !== "auto" && node.scrollWidth > node.clientWidth + 1) faults.push(`cut: "${text.data.trim().slice(0, 60)}"`);
  }
  for (let i = 0; i < texts.length; i++) {
    const a = texts[i];
    // A scrolled list may cut a line at its edge; a text that is outside of the window cannot be reached.
    if (a.whole.left < -1 || a.whole.right > W + 1 || a.top < -1 || a.bottom > H + 1) faults.push(`outside: "${a.words}"`);
    for (let j = i + 1; j < texts.length; j++) {
      const b = texts[j];
      if (a.node === b.node || layer(a.node) !== layer(b.node)) continue;
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (wide > 2 && high > 3) faults.push(`overlap: "${a.words}" and "${b.words}"`);
    }
  }
  for (const node of document.querySelectorAll("button, input, [tabindex='0']")) {
    if (!seen(node)) continue;
    const box = node.getBoundingClientRect();
    if (box.left < -1 || box.right > W + 1) faults.push(`outside: ${node.dataset.testid ?? node.id ?? node.className}`);
    if (box.width < 24 || box.height < 24) faults.push(`small: ${node.dataset.testid ?? node.className} ${Math.round(box.width)}x${Math.round(box.height)}`);
  }
  const numbers = (colour) => {
    const [r, g, b, a = 1] = (colour.match(/[\d.]+/g) ?? [0, 0, 0, 0]).map(Number);
    return [r, g, b, a];
  };
  const light = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const behind = (node) => {
    const over = [];
    for (let up = node; up; up = up.parentElement) {
      const colour = numbers(getComputedStyle(up).backgroundColor);
      if (colour[3] > 0) over.push(colour);
      if (colour[3] === 1) break;
    }
    return over.reverse().reduce((under, [r, g, b, a]) => [r, g, b].map((c, k) => a * c + (1 - a) * under[k]), [255, 255, 255]);
  };
  for (const { node, words } of texts) {
    if (node.closest(":disabled")) continue;
    const style = getComputedStyle(node);
    const [a, b] = [light(numbers(style.color)), light(behind(node))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (contrast < (large ? 3 : 4.5)) faults.push(`contrast ${contrast.toFixed(2)}: "${words}"`);
  }
  // Under a finger, a control must be what is seen there.
  for (const node of document.querySelectorAll("button:not(:disabled)")) {
    if (!seen(node) || document.querySelector(".sheet:not([hidden])")) continue;
    const part = clipped(node.getBoundingClientRect(), node);
    if (!part || part.bottom - part.top < 12) continue;
    const hit = document.elementFromPoint((part.left + part.right) / 2, (part.top + part.bottom) / 2);
    if (hit && !node.contains(hit) && !hit.contains(node) && !hit.closest(LAYERS)) faults.push(`covered: ${node.dataset.testid ?? node.className} by ${hit.dataset?.testid ?? hit.className}`);
  }
  const root = document.scrollingElement;
  if (root.scrollWidth > W + 1 || root.scrollHeight > H + 1) faults.push(`the page scrolls: ${root.scrollWidth}x${root.scrollHeight} in ${W}x${H}`);
  return [...new Set(faults)];
})()
