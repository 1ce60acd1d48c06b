// views in frames are light or dark with the page around them
const paintViews = () => {
  const theme = document.body.dataset.mdColorScheme === "slate" ? "dark" : "light";
  for (const frame of document.querySelectorAll("iframe")) frame.contentWindow?.view?.setTheme?.(theme);
};
document$.subscribe(() => {
  for (const frame of document.querySelectorAll("iframe")) frame.addEventListener("load", paintViews);
  paintViews();
});
new MutationObserver(paintViews).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
