#![no_main]
osp_fuzz::fuzz!(small_files);
