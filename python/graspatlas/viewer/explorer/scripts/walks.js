// The graph of the charts: neighbours, charts that no neighbour beats, and shortest chains from chart to chart.

class Graph {
  constructor(numbers) {
    const n = (this.n = facts.n_charts);
    const counts = numbers.get("neighbour_counts"), steps = numbers.get("neighbour_steps");
    this.start = new Uint32Array(n + 1);
    for (let i = 0, p = 0; i < n; i++)
      for (const end = p + counts[i]; p < end; p++) {
        this.start[i + 1]++;
        this.start[i + steps[p] + 1]++;
      }
    for (let i = 0; i < n; i++) this.start[i + 1] += this.start[i];
    this.ends = new Uint32Array(this.start[n]);
    const next = this.start.slice(0, n);
    for (let i = 0, p = 0; i < n; i++)
      for (const end = p + counts[i]; p < end; p++) {
        const j = i + steps[p];
        this.ends[next[i]++] = j;
        this.ends[next[j]++] = i;
      }
  }

  neighbours(chart) {
    return this.ends.subarray(this.start[chart], this.start[chart + 1]);
  }

  // Charts that no neighbour beats, the best first; of connected equals the first, if none of them is beaten.
  localMaxima(values, counts) {
    const seen = new Uint8Array(this.n), found = [];
    for (let chart = 0; chart < this.n; chart++) {
      if (seen[chart] || !counts[chart]) continue;
      const equals = [chart];
      let beaten = false;
      seen[chart] = 1;
      for (let at = 0; at < equals.length; at++)
        for (const other of this.neighbours(equals[at])) {
          if (!counts[other]) continue;
          if (values[other] > values[chart]) beaten = true;
          else if (values[other] === values[chart] && !seen[other]) {
            seen[other] = 1;
            equals.push(other);
          }
        }
      if (!beaten) found.push(chart);
    }
    return found.sort((a, b) => values[b] - values[a] || a - b);
  }

  // The shortest chain of neighbours between two charts through those that count, or null (Dijkstra's algorithm).
  shortestChain(from, to, counts, length) {
    const distance = new Float64Array(this.n).fill(Infinity), before = new Int32Array(this.n).fill(-1);
    const done = new Uint8Array(this.n), heap = new Heap();
    distance[from] = 0;
    heap.push(0, from);
    while (heap.size) {
      const chart = heap.pop();
      if (done[chart]) continue;
      done[chart] = 1;
      if (chart === to) break;
      for (const other of this.neighbours(chart)) {
        if (done[other] || !(counts[other] || other === to)) continue;
        const way = distance[chart] + length(chart, other);
        if (way < distance[other]) {
          distance[other] = way;
          before[other] = chart;
          heap.push(way, other);
        }
      }
    }
    if (!done[to]) return null;
    const chain = [to];
    while (chain[0] !== from) chain.unshift(before[chain[0]]);
    return chain;
  }
}

// Items with keys, the least first.
class Heap {
  constructor() {
    this.keys = [];
    this.items = [];
  }

  get size() {
    return this.keys.length;
  }

  push(key, item) {
    let at = this.keys.length;
    while (at > 0) {
      const up = (at - 1) >> 1;
      if (this.keys[up] <= key) break;
      this.keys[at] = this.keys[up];
      this.items[at] = this.items[up];
      at = up;
    }
    this.keys[at] = key;
    this.items[at] = item;
  }

  pop() {
    const first = this.items[0], key = this.keys.pop(), item = this.items.pop(), n = this.keys.length;
    for (let at = 0; n > 0; ) {
      let down = 2 * at + 1;
      if (down + 1 < n && this.keys[down + 1] < this.keys[down]) down++;
      if (down >= n || this.keys[down] >= key) {
        this.keys[at] = key;
        this.items[at] = item;
        break;
      }
      this.keys[at] = this.keys[down];
      this.items[at] = this.items[down];
      at = down;
    }
    return first;
  }
}
