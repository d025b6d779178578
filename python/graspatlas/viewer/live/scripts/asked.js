// Requests to the server that the page comes from, with the token that it has given the page.

const TOKEN = "X-Graspatlas-Token";

async function asked(path, body) {
  const headers = { [TOKEN]: facts.live.token };
  const options = body ? { method: "POST", headers: { ...headers, "Content-Type": "application/json" }, body: JSON.stringify(body) } : { headers };
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Error("graspatlas does not answer: it has ended, or the connection is lost");
  }
  const table = await response.json();
  if (!response.ok) throw new Error(table.error);
  return table;
}
