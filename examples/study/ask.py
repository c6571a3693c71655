"""Runs queries on the lines of a study: `ask.py results.ndjson [query.sql...]`; by default all (needs `pip install duckdb`)."""

import sys
from pathlib import Path

import duckdb

QUESTIONS = ["errors", "growth", "machines", "quantiles", "wins"]

here = Path(__file__).parent
lines, *questions = sys.argv[1:]
tables = (here / "tables.sql").read_text(encoding="utf-8")
duckdb.sql(tables.replace("read_json('results.ndjson'", "read_json('" + lines.replace("'", "''") + "'"))
for question in [Path(name) for name in questions] or [here / f"{name}.sql" for name in QUESTIONS]:
    print(f"== {question.stem}")
    answer = duckdb.sql(question.read_text(encoding="utf-8"))
    if answer is not None:
        answer.show(max_rows=10_000, max_width=200)
