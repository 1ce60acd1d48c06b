// the extension arithmatex leaves \( \) and \[ \] in elements of its class
document$.subscribe(() => {
  for (const element of document.querySelectorAll(".arithmatex:not(:has(.katex))")) {
    const text = element.textContent;
    katex.render(text.slice(2, -2), element, { displayMode: text.startsWith("\\["), throwOnError: false });
  }
});
