-- Two views of the lines of a study: `sessions` has a row for each line, `runs` a row for each session and index.
-- 'results/*.ndjson' reads several files. DuckDB skips incomplete lines, which a killed process may leave.
CREATE OR REPLACE TEMP VIEW sessions AS
SELECT * EXCLUDE (machine, report), unnest(machine), unnest(report)
FROM read_json('results.ndjson', format = 'newline_delimited', ignore_errors = true, maximum_object_size = 16777216, columns = {
    file: 'VARCHAR', file_hash: 'VARCHAR', file_bytes: 'UBIGINT', format: 'VARCHAR', error: 'VARCHAR',
    remarks: 'VARCHAR[]', skipped: 'UBIGINT', measuring_s: 'DOUBLE', options: 'VARCHAR',
    machine: 'STRUCT(host VARCHAR, processor VARCHAR, threads UBIGINT, system VARCHAR, simd VARCHAR, osp_version VARCHAR,
        osp_commit VARCHAR, osp_program VARCHAR, optimized BOOLEAN)',
    report: 'STRUCT(strokes UBIGINT, points UBIGINT, polygons UBIGINT, frames UBIGINT, pace VARCHAR, camera VARCHAR,
        indexes_agree BOOLEAN, runs STRUCT("index" VARCHAR, occlusion VARCHAR, insert_ns_per_polygon DOUBLE, cull_us DOUBLE,
            frame_us STRUCT(p50 DOUBLE, p95 DOUBLE, p99 DOUBLE, "max" DOUBLE), visible_mean DOUBLE, culled_mean DOUBLE,
            occluded_mean DOUBLE, occlusion_us DOUBLE, bytes UBIGINT, allocations_steady UBIGINT, frames_measured UBIGINT,
            frames_fingerprinted UBIGINT, refused UBIGINT, fingerprint VARCHAR, drawn_fingerprint VARCHAR)[])'
});
CREATE OR REPLACE TEMP VIEW runs AS
SELECT * EXCLUDE (run), unnest(run)
FROM (SELECT * EXCLUDE (runs, error), unnest(runs) AS run FROM sessions WHERE error IS NULL);
