// In a frame: as high as what it holds, where the page around lets itself be measured.
(() => {
  let frame = null;
  try { frame = window.frameElement; } catch { /* of another origin: it keeps its height, and scrolls */ }
  if (!frame) return;
  const fit = () => { frame.style.height = Math.ceil(document.documentElement.getBoundingClientRect().height) + "px"; };
  new ResizeObserver(fit).observe(document.documentElement);
})();
