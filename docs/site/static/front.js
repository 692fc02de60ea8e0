// The button that holds the loop: motion that does not end needs one.
const button = document.getElementById("pause");
button.addEventListener("click", () => {
  const held = document.body.classList.toggle("held");
  button.setAttribute("aria-pressed", String(held));
  button.textContent = held ? "Go on" : "Pause";
});

// Colours as on the other pages, whose theme keeps the choice under the same name.
const NEXT = { auto: "dark", dark: "light", light: "auto" };
const colours = document.getElementById("colours");
const show = (theme) => {
  document.documentElement.dataset.theme = theme;
  colours.setAttribute("aria-label", `Colours: ${theme}. Switch to ${NEXT[theme]}`);
};
const kept = localStorage.getItem("theme");
show(kept in NEXT ? kept : "auto");
colours.addEventListener("click", () => {
  const theme = NEXT[document.documentElement.dataset.theme];
  localStorage.setItem("theme", theme);
  show(theme);
});
