/** Small helpers for the page. Text goes in by textContent only: names come from elsewhere and are never HTML. */

/** @param {string} id @returns {HTMLElement} */
export const byId = (id) => document.getElementById(id);

/**
 * Make an element.
 * @param {string} tag
 * @param {Object<string, any>} [options] text, testid, or any attribute
 * @param {...Node} children
 */
export function make(tag, { text, testid, ...attributes } = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (testid !== undefined) node.dataset.testid = testid;
  if (text !== undefined) node.textContent = text;
  node.append(...children);
  return node;
}

/** Set a text only where it differs: a live region would say it again, and the layout would be done again. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** @param {HTMLElement} node @param {boolean} shown */
export function show(node, shown) {
  if (node.hidden === shown) node.hidden = !shown;
}

/** Set an attribute only where it differs. */
export function setAttribute(node, name, value) {
  if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
}

/** What is kept for the next visit; storage may be forbidden, which must not break a console. */
export const kept = {
  get(key, otherwise) {
    try {
      const text = localStorage.getItem(`airground.${key}`);
      return text === null ? otherwise : JSON.parse(text);
    } catch {
      return otherwise;
    }
  },
  set(key, value) {
    try {
      localStorage.setItem(`airground.${key}`, JSON.stringify(value));
    } catch {
      // Then it holds for this visit.
    }
  },
};
