// The button that holds the loop: motion that does not end needs one.
const button = document.getElementById("pause");
button.addEventListener("click", () => {
  const held = document.body.classList.toggle("held");
  button.setAttribute("aria-pressed", String(held));
  button.textContent = held ? "Go on" : "Pause";
});
