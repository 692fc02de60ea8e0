// Ctrl+K leads to the search of every page, as / does by the theme; on a phone it is in the menu.
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest("input, textarea, select");
  const wanted = event.key === "/" ? !typing : event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey);
  if (!wanted || event.altKey) return;
  event.preventDefault();
  const menu = document.getElementById("__navigation");
  if (menu !== null) menu.checked = true;
  document.querySelector("input[name=q]").focus();
});
