// What scrolls can be scrolled with the keyboard.
function makeFocusable() {
  for (const part of document.querySelectorAll(".table-wrapper, pre, .sidebar-scroll, .toc-scroll")) {
    if (part.scrollWidth > part.clientWidth || part.scrollHeight > part.clientHeight) {
      part.tabIndex = 0;
    }
  }
}
document.addEventListener("DOMContentLoaded", makeFocusable);
window.addEventListener("resize", makeFocusable);
