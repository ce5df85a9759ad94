// Colours of numbers: even steps look even (the points of matplotlib's viridis, by Smith and van der Walt, CC0).
const stops = [
  [68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140], [34, 168, 132],
  [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37],
];

export function ramp(part) {
  const at = Math.min(Math.max(part, 0), 1) * (stops.length - 1), i = Math.min(Math.floor(at), stops.length - 2);
  return stops[i].map((low, k) => Math.round(low + (at - i) * (stops[i + 1][k] - low)));
}

export function rampBytes(count = 256) {
  const data = new Uint8Array(4 * count);
  for (let i = 0; i < count; ++i) data.set([...ramp(i / (count - 1)), 255], 4 * i);
  return data;
}
