// Colours that people with poor colour sight can tell apart.
// Source: M. Okabe and K. Ito, Color Universal Design, 2008 (the eight colours); the ramp is made of
// points on the viridis map of S. van der Walt and N. Smith, 2015.

export const JOINTS = ['#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#8a7c00', '#7d6bd0'];

const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** A share 0..1 as red, green, blue 0..1, written into `into` at `at`. */
export function ramp(share, into, at) {
  const place = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
  const low = Math.min(Math.floor(place), RAMP.length - 2);
  const part = place - low;
  for (let k = 0; k < 3; k += 1) {
    into[at + k] = (RAMP[low][k] + (RAMP[low + 1][k] - RAMP[low][k]) * part) / 255;
  }
}

/** Draws the ramp from left to right. */
export function drawRamp(canvas) {
  const context = canvas.getContext('2d');
  const colour = [0, 0, 0];
  for (let x = 0; x < canvas.width; x += 1) {
    ramp(x / (canvas.width - 1), colour, 0);
    context.fillStyle = `rgb(${colour.map((part) => Math.round(part * 255)).join(' ')})`;
    context.fillRect(x, 0, 1, canvas.height);
  }
}

/** The value of a colour of the style sheet. */
export function styled(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
