// Comparison of pictures: what differs, in words; an empty list when nothing does.

/** Status and depth must be equal bit for bit, colours within `tolerance` of 255. */
export function differences(found, expected, tolerance) {
  const problems = [];
  for (const [kind, most] of [["status", 0], ["depth", 0], ["color", tolerance]]) {
    const [a, b] = [found[kind], expected[kind]];
    if (a.length !== b.length) {
      problems.push(`${kind}: ${a.length} bytes, expected ${b.length}`);
      continue;
    }
    let count = 0;
    let worst = 0;
    for (let i = 0; i < a.length; i++) {
      const difference = Math.abs(a[i] - b[i]);
      if (difference > most) count++;
      worst = Math.max(worst, difference);
    }
    if (count > 0) problems.push(`${kind}: ${count} of ${a.length} bytes differ, by up to ${worst}`);
  }
  return problems;
}

/** Share of the bytes of two pictures' colours that differ. */
export function changedShare(a, b) {
  if (a.length !== b.length) return 1;
  let count = 0;
  for (let i = 0; i < a.length; i++) count += a[i] === b[i] ? 0 : 1;
  return count / a.length;
}
