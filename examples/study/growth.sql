-- How the time of a frame grows with the number of polygons. A row has the sessions of similar size (a third of a decade). `exponent_over_all` fits all sessions: frame time ~ polygons ^ exponent (0: no growth, 1: proportional).
WITH measured AS (
    SELECT index, polygons, frame_us.p50 AS frame_p50_us, bytes
    FROM runs
    WHERE occlusion IS NULL AND polygons > 0 AND frame_us.p50 > 0 AND frames_fingerprinted = frames
), power_law AS (
    SELECT index, round(regr_slope(ln(frame_p50_us), ln(polygons)), 2) AS exponent
    FROM measured
    GROUP BY index
)
SELECT index, CAST(round(10 ** (floor(log10(polygons) * 3) / 3)) AS BIGINT) AS polygons_from, count(*) AS sessions,
       round(median(frame_p50_us), 2) AS frame_p50_us,
       round(median(bytes / polygons), 1) AS bytes_a_polygon,
       any_value(exponent) AS exponent_over_all
FROM measured JOIN power_law USING (index)
GROUP BY index, polygons_from
ORDER BY index, polygons_from;
