-- The lines of a study as two Parquet files.
COPY sessions TO 'sessions.parquet';
COPY runs TO 'runs.parquet';
