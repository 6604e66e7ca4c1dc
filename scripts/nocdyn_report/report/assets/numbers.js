"use strict";
// The arrays of the report, and numbers as its tables write them.
const content = JSON.parse(document.getElementById("data").textContent);
const decoded = [];

function array(number) {
  if (!decoded[number]) {
    const text = atob(content.arrays[number]), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    decoded[number] = new Float32Array(bytes.buffer);
  }
  return decoded[number];
}

function exponentText(exponent) {
  return String(exponent).replace(/./g, (one) => (one === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(one)]));
}

// As numbers.py writes them.
function numberText(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  const trim = (text) => (text.includes(".") ? text.replace(/0+$/, "").replace(/\.$/, "") : text).replace("-", "−");
  if (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6) return `${trim(mantissa)} × 10${exponentText(Number(exponent))}`;
  const text = trim(Number(`${mantissa}e${exponent}`).toFixed(Math.max(0, digits - 1 - Number(exponent))));
  return Math.abs(value) >= 1e4 ? text.replace(/\B(?=(\d{3})+(?!\d))/g, " ") : text;
}

const withUnit = (label, unit) => (unit ? `${label} [${unit.replace("m2", "m²")}]` : label);
