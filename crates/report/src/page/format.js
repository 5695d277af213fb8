// Numbers and times as text.

const MINUS = "\u2212";

/** A number with so many decimals; no minus before zero. */
function fixed(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", MINUS);
}

/** The fewest decimals in which a step of an axis is exact. */
function decimalsOf(step) {
  for (let decimals = 0; decimals < 10; decimals++) {
    const scaled = step * 10 ** decimals;
    if (Math.abs(scaled - Math.round(scaled)) < 1e-6 * scaled) return decimals;
  }
  return 10;
}

/** A number on an axis whose marks are `step` apart. */
function tick(value, step) {
  if (value === 0) return "0";
  const decimals = decimalsOf(step);
  // Longer ones would run into the axis's title.
  if (decimals > 4 || Math.abs(value) >= 1e6) {
    const digits = Math.max(0, Math.round(Math.log10(Math.abs(value) / step)));
    return value.toExponential(Math.min(digits, 6)).replace("e+", "e").replaceAll("-", MINUS);
  }
  return fixed(value, decimals);
}

const SUPERSCRIPT = { "-": "\u207b", 0: "\u2070", 1: "\u00b9", 2: "\u00b2", 3: "\u00b3", 4: "\u2074", 5: "\u2075",
  6: "\u2076", 7: "\u2077", 8: "\u2078", 9: "\u2079" };

/** A number on a logarithmic axis. */
function logTick(value) {
  const exponent = Math.round(Math.log10(value));
  if (value >= 0.00099 && value < 1e5) return String(Number(value.toPrecision(3)));
  const power = "10" + String(exponent).replace(/./g, (c) => SUPERSCRIPT[c]);
  const factor = Number((value / 10 ** exponent).toPrecision(2));
  return factor === 1 ? power : `${factor}\u00b7${power}`;
}

/** The marks of a logarithmic axis: powers of ten, and 2 and 5 between them where it shows few decades. */
function logSplits(low, high) {
  const first = Math.floor(Math.log10(low)), last = Math.ceil(Math.log10(high));
  const every = Math.ceil((last - first) / 10);
  const factors = last - first <= 3 ? [1, 2, 5] : [1];
  const splits = [];
  for (let power = first; power <= last; power += every) for (const factor of factors) splits.push(factor * 10 ** power);
  return splits.filter((value) => value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9));
}

/** A value under the cursor, as fine as a thousandth of what the plot spans. */
function reading(value, span) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || (size < 1e-4 && span < 1e-3)) return value.toExponential(3).replaceAll("-", MINUS);
  const decimals = Math.ceil(3 - Math.log10(span > 0 ? span : size));
  return fixed(value, Math.min(9, Math.max(0, decimals)));
}

/** Seconds as h:mm:ss with decimals. */
function clock(seconds, decimals) {
  const unit = 10 ** decimals;
  const total = Math.round(Math.abs(seconds) * unit);
  const whole = Math.floor(total / unit);
  const two = (number) => String(number).padStart(2, "0");
  const fraction = decimals > 0 ? "." + String(total % unit).padStart(decimals, "0") : "";
  const sign = seconds < 0 && total > 0 ? MINUS : "";
  return `${sign}${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}${fraction}`;
}

/** A count with its thousands apart. */
function grouped(count) {
  return String(Math.round(count)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}
