// Undoes report/pack.cpp.

async function inflated(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The integers of one array: byte planes joined, zigzag undone, differences summed up. */
function integers(bytes, {offset, length, components, bytes: width}) {
  const values = width === 2 ? new Uint16Array(length) : new Uint32Array(length);
  for (let i = 0; i < length; ++i) {
    let z = 0;
    for (let b = 0; b < width; ++b) z |= bytes[offset + b * length + i] << (8 * b);
    const difference = (z >>> 1) ^ -(z & 1);
    values[i] = difference + (i < components ? 0 : values[i - components]);
  }
  return values;
}

const kNoValue = 65535;

/** Coordinates in mm from integers in a box. */
function coordinates(steps, [lower, upper]) {
  const result = new Float32Array(steps.length);
  for (let i = 0; i < steps.length; ++i) {
    const k = i % 3;
    result[i] = lower[k] + (upper[k] - lower[k]) * steps[i] / 65535;
  }
  return result;
}

function fieldValues(steps, low, high) {
  const result = new Float32Array(steps.length);
  for (let i = 0; i < steps.length; ++i) {
    result[i] = steps[i] === kNoValue || low === undefined ? NaN : low + (high - low) * steps[i] / 65534;
  }
  return result;
}

/**
 * {name: typed array}. `raw` keeps the integers of arrays that others refer to; pass the same object for the packs of
 * steps.
 */
export async function unpack(pack, raw) {
  const bytes = await inflated(pack.data);
  const arrays = {};
  for (const entry of pack.arrays) {
    const values = integers(bytes, entry);
    if (entry.reference) {
      const reference = raw[entry.reference];
      for (let i = 0; i < values.length; ++i) values[i] += reference[i];
    }
    if (entry.box) {
      if (!(entry.name in raw)) raw[entry.name] = values;
      arrays[entry.name] = coordinates(values, entry.box);
    } else if (entry.bytes === 2) {
      arrays[entry.name] = fieldValues(values, entry.low, entry.high);
    } else {
      arrays[entry.name] = values;
    }
  }
  return arrays;
}

/** Views of the lines that `counts` cuts `points` into. */
export function lines(points, counts) {
  const result = [];
  let begin = 0;
  for (const count of counts) {
    result.push(points.subarray(3 * begin, 3 * (begin + count)));
    begin += count;
  }
  return result;
}
