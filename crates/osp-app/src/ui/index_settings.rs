use egui::{Button, ComboBox, Slider, Ui, emath::Numeric};

use super::panel_commands::PanelCommands;
use crate::{command::Command, studio::Studio};
use osp_rivals::{CutNodes, IndexKind, IndexSetting, IndexSettings};

/// The settings of the index, as they are chosen in the panel.
#[derive(Debug, Default)]
pub(super) struct IndexSettingsPanel {
    /// Settings that are not applied yet.
    chosen: Option<IndexSettings>,
}

impl IndexSettingsPanel {
    /// Shows the settings that the index has; nothing for an index without settings. The model is inserted again only
    /// when the user applies the settings, because the insertion of a large model takes long.
    pub(super) fn show(&mut self, ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        let (kind, applied) = (studio.culling().kind(), *studio.culling().index_settings());
        let has = |setting: &IndexSetting| kind.has(*setting);
        if !IndexSetting::ALL.iter().any(has) {
            return;
        }
        let mut settings = self.chosen.unwrap_or(applied);
        for setting in IndexSetting::ALL.into_iter().filter(has) {
            edit(ui, kind, setting, &mut settings);
        }
        ui.horizontal(|ui| {
            if ui.add_enabled(settings != applied, Button::new("Apply")).clicked() {
                panel_commands.commands.push(Command::IndexSettings(settings));
            }
            let usual = IndexSettings::default();
            if ui.add_enabled(settings != usual, Button::new("Defaults")).clicked() {
                settings = usual;
            }
        });
        self.chosen = (settings != applied).then_some(settings);
    }
}

fn edit(ui: &mut Ui, kind: IndexKind, setting: IndexSetting, settings: &mut IndexSettings) {
    let name = setting.name();
    match setting {
        IndexSetting::MaxDepth => {
            let now = kind.max_depth(settings).unwrap_or_default();
            let deeper = slide(ui, name, now, IndexSettings::DEPTHS, false);
            settings.max_depth = deeper.or(settings.max_depth);
        }
        IndexSetting::Cube => {
            settings.cube =
                slide(ui, name, settings.cube, IndexSettings::CUBES, true).unwrap_or(settings.cube);
        }
        IndexSetting::CutNodes => {
            ComboBox::from_label(name).selected_text(settings.cut_nodes.name()).show_ui(ui, |ui| {
                for choice in CutNodes::ALL {
                    ui.selectable_value(&mut settings.cut_nodes, choice, choice.name());
                }
            });
        }
        IndexSetting::Buckets => {
            let wanted = slide(ui, name, settings.buckets, IndexSettings::BUCKETS, false);
            settings.buckets = wanted.unwrap_or(settings.buckets);
        }
        IndexSetting::LeafCapacity => {
            let now = kind.leaf_capacity(settings).unwrap_or_default();
            let larger = slide(ui, name, now, IndexSettings::LEAF_CAPACITIES, true);
            settings.leaf_capacity = larger.or(settings.leaf_capacity);
        }
        IndexSetting::MortonBits => {
            let wanted = slide(ui, name, settings.morton_bits, IndexSettings::MORTON_BITS, false);
            settings.morton_bits = wanted.unwrap_or(settings.morton_bits);
        }
    }
}

/// A slider. Returns its value if the user changes it.
fn slide<N: Numeric>(
    ui: &mut Ui,
    name: &str,
    now: N,
    range: std::ops::RangeInclusive<N>,
    is_logarithmic: bool,
) -> Option<N> {
    let mut wanted = now;
    let slider = Slider::new(&mut wanted, range).logarithmic(is_logarithmic).text(name);
    ui.add(slider).changed().then_some(wanted)
}
