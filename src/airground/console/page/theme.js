// Runs before the page is drawn, so that nobody sees a flash of the other theme. A module would come too late.
(() => {
  let wish = null;
  try {
    wish = JSON.parse(localStorage.getItem("airground.theme"));
  } catch {
    // Storage may be forbidden; then the system's choice holds.
  }
  if (wish === "dark" || wish === "light") document.documentElement.dataset.theme = wish;
})();
