#![no_main]
osp_fuzz::fuzz!(frame_occlusion);
