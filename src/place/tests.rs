use super::*;

fn crs(epsg: u32) -> Result<Option<Globe>> {
    Placement::Crs { epsg, height_offset: 0.0 }.globe()
}

fn globe(epsg: u32) -> Globe {
    crs(epsg).unwrap().unwrap()
}

fn geodetic(lon: f64, lat: f64, height: f64) -> DVec3 {
    wgs84_to_ecef(lon.to_radians(), lat.to_radians(), height)
}

/// The example of GeographicLib's GeoConvert, and Snyder's system of 1987, to the digits printed.
#[test]
fn published_utm_coordinates_are_met_to_a_centimetre() {
    let found = globe(32638).to_ecef(DVec3::new(444_140.54, 3_684_706.36, 35.0)).unwrap();
    let off = found.distance(geodetic(44.4, 33.3, 35.0));
    assert!(off < 0.01, "{off}");
}

/// UTM by Krüger's series to the sixth order, good to nanometres, written down apart from the
/// library that is used: coefficients after Karney, Transverse Mercator with an accuracy of a few
/// nanometers, 2011, equation 35.
fn krueger(lon_from_meridian: f64, lat: f64) -> [f64; 2] {
    let (a, f) = (6_378_137.0, 1.0 / 298.257_222_101);
    let n: f64 = f / (2.0 - f);
    let e = (f * (2.0 - f)).sqrt();
    let alpha = [
        n / 2.0 - 2.0 / 3.0 * n.powi(2) + 5.0 / 16.0 * n.powi(3) + 41.0 / 180.0 * n.powi(4),
        13.0 / 48.0 * n.powi(2) - 3.0 / 5.0 * n.powi(3) + 557.0 / 1440.0 * n.powi(4),
        61.0 / 240.0 * n.powi(3) - 103.0 / 140.0 * n.powi(4),
        49561.0 / 161280.0 * n.powi(4),
    ];
    let tau = lat.tan();
    let sigma = (e * (e * tau / tau.hypot(1.0)).atanh()).sinh();
    let tau = tau * sigma.hypot(1.0) - sigma * tau.hypot(1.0);
    let xi0 = tau.atan2(lon_from_meridian.cos());
    let eta0 = (lon_from_meridian.sin() / tau.hypot(lon_from_meridian.cos())).asinh();
    let (mut xi, mut eta) = (xi0, eta0);
    for (alpha, j) in alpha.into_iter().zip(1..) {
        let twice = 2.0 * f64::from(j);
        xi += alpha * (twice * xi0).sin() * (twice * eta0).cosh();
        eta += alpha * (twice * xi0).cos() * (twice * eta0).sinh();
    }
    let radius = a / (1.0 + n) * (1.0 + n * n / 4.0 + n.powi(4) / 64.0);
    [500_000.0 + 0.9996 * radius * eta, 0.9996 * radius * xi]
}

#[test]
fn utm_agrees_with_kruegers_series_across_a_zone() {
    let globe = globe(25832);
    for lon in [6.0f64, 8.25, 9.0, 11.42, 14.0] {
        for lat in [0.5f64, 36.0, 48.76, 60.0, 80.0] {
            let [x, y] = krueger((lon - 9.0).to_radians(), lat.to_radians());
            let found = globe.to_ecef(DVec3::new(x, y, 400.0)).unwrap();
            let off = found.distance(geodetic(lon, lat, 400.0));
            // WGS 84 and GRS 80 differ by a tenth of a millimetre.
            assert!(off < 0.001, "{lon} {lat}: {off}");
        }
    }
}

#[test]
fn a_city_of_kilometres_is_fitted_block_by_block_to_a_centimetre() {
    let globe = globe(25832);
    for block in 0..20 {
        let low = DVec3::new(670_000.0 + 500.0 * f64::from(block), 5_403_000.0, 350.0);
        let high = low + DVec3::new(500.0, 500.0, 150.0);
        let fit = globe.fit(low, high).unwrap();
        let residual = fit.residual(|point| globe.to_ecef(point), low, high);
        assert!(residual < 0.008, "{residual}");
    }
}

#[test]
fn heights_are_raised_by_what_was_asked_for() {
    let point = DVec3::new(678_016.0, 5_403_456.0, 370.0);
    let raised = Placement::Crs { epsg: 25832, height_offset: 46.5 }.globe().unwrap().unwrap();
    let off = raised.to_ecef(point).unwrap() - globe(25832).to_ecef(point).unwrap();
    assert!((off.length() - 46.5).abs() < 1e-6);
    assert!(off.dot(point) > 0.0);
}

#[test]
fn feet_are_feet_of_the_ground_alone() {
    // New York Long Island, US survey feet: Manhattan.
    let point = DVec3::new(985_000.0, 210_000.0, 10.0);
    let found = globe(2263).to_ecef(point).unwrap();
    let step = globe(2263).to_ecef(point + DVec3::X).unwrap() - found;
    assert!((step.length() - 0.3048).abs() < 1e-4, "{}", step.length());
    assert!(found.distance(geodetic(-74.0, 40.74, 10.0)) < 3000.0);
}

#[test]
fn what_is_no_usable_system_is_refused_with_its_code() {
    for (epsg, word) in [
        (99_999, "not a known"),
        (1, "not a known"),
        (4326, "degrees"),
        (4258, "degrees"),
        (26733, "EPSG:26733"),
    ] {
        let text = crs(epsg).unwrap_err().to_string();
        assert!(text.contains(word) && text.contains(&epsg.to_string()), "{text}");
    }
}

#[test]
fn origins_off_the_globe_are_refused() {
    for [lon, lat, height] in [
        [181.0, 0.0, 0.0],
        [0.0, 90.5, 0.0],
        [0.0, 0.0, 7e6],
        [f64::NAN, 0.0, 0.0],
        [0.0, 0.0, f64::INFINITY],
    ] {
        assert!(
            Placement::Origin(Place { lon, lat, height }).globe().is_err(),
            "{lon} {lat} {height}"
        );
    }
}

#[test]
fn coordinates_of_another_system_are_refused() {
    let misfit = |epsg, low: [f64; 3]| {
        let low = DVec3::from(low);
        globe(epsg).misfit(low, low + 500.0)
    };
    assert_eq!(misfit(25832, [678_016.0, 5_403_456.0, 400.0]), None);
    assert_eq!(misfit(3946, [1.84e6, 5.17e6, 200.0]), None);
    assert_eq!(misfit(28992, [84_000.0, 446_000.0, 0.0]), None);
    assert!(misfit(25832, [0.0, 0.0, 0.0]).unwrap().contains("local"));
    assert!(misfit(25832, [11.42, 48.76, 400.0]).unwrap().contains("local"));
    assert!(misfit(25832, [3_171_000.0, 5_403_456.0, 400.0]).is_some(), "23 degrees away");
    assert!(misfit(25832, [678_016.0, 5_403_456.0, 2e6]).unwrap().contains("ellipsoid"));
    assert!(misfit(4978, [678_016.0, 5_403_456.0, 400.0]).unwrap().contains("centre"));
    assert!(misfit(25832, [1e12, 5e6, 0.0]).is_some());
    let origin = Placement::Origin(Place { lon: 11.4, lat: 48.7, height: 370.0 });
    let tangent = origin.globe().unwrap().unwrap();
    assert!(tangent.misfit(DVec3::splat(678_016.0), DVec3::splat(678_100.0)).is_some());
    assert_eq!(tangent.misfit(DVec3::splat(-500.0), DVec3::splat(500.0)), None);
}

#[test]
fn systems_with_a_datum_of_their_own_say_so() {
    assert_eq!(globe(25832).caveat(), None);
    assert_eq!(globe(32632).caveat(), None);
    assert!(globe(28992).caveat().unwrap().contains("28992"));
    assert!(globe(31467).caveat().is_some());
}

#[test]
fn a_box_with_y_up_turns() {
    let (low, high) = z_up(UpAxis::Y, [1.0, 2.0, 3.0], [10.0, 20.0, 30.0]);
    assert_eq!((low, high), (DVec3::new(1.0, -30.0, 2.0), DVec3::new(10.0, -3.0, 20.0)));
}
