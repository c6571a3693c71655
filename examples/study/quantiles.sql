-- The times of each index over all sessions: quantiles of the sessions' medians and 99th percentiles. `times_osp` is the ratio to the time of `osp` in the same session on the same machine. Omits runs that were too slow for every frame.
WITH measured AS (
    SELECT *, frame_us.p50 AS frame_p50_us, frame_us.p99 AS frame_p99_us, frame_us.max AS frame_max_us
    FROM runs
    WHERE occlusion IS NULL AND frames > 0 AND frames_fingerprinted = frames
), beside AS (
    SELECT m.*, m.frame_p50_us / nullif(o.frame_p50_us, 0) AS times_osp
    FROM measured AS m
    LEFT JOIN measured AS o
        ON o.index = 'osp' AND (o.file, o.file_hash, o.host, o.options, o.osp_commit)
                             = (m.file, m.file_hash, m.host, m.options, m.osp_commit)
)
SELECT index, count(*) AS sessions,
       round(quantile_cont(frame_p50_us, 0.5), 2) AS p50_us_median_session,
       round(quantile_cont(frame_p50_us, 0.95), 2) AS p50_us_95th_session,
       round(quantile_cont(frame_p99_us, 0.5), 2) AS p99_us_median_session,
       round(quantile_cont(frame_p99_us, 0.95), 2) AS p99_us_95th_session,
       round(max(frame_max_us), 1) AS slowest_frame_us,
       round(quantile_cont(times_osp, 0.05), 2) AS times_osp_5th,
       round(quantile_cont(times_osp, 0.5), 2) AS times_osp_median,
       round(quantile_cont(times_osp, 0.95), 2) AS times_osp_95th
FROM beside
GROUP BY index
ORDER BY p50_us_median_session;
