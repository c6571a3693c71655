"""Asks the questions of this folder of a study: `ask.py results.ndjson [question.sql...]` (needs `pip install duckdb`)."""

import sys
from pathlib import Path

import duckdb

table, *questions = sys.argv[1:]
here = Path(__file__).parent
for question in map(Path, questions) if questions else sorted(here.glob("*.sql")):
    text = question.read_text(encoding="utf-8").replace("'results.ndjson'", "'" + table.replace("'", "''") + "'")
    print(f"== {question.stem}")
    duckdb.sql(text).show(max_rows=10_000, max_width=200)
